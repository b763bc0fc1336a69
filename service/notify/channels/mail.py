"""How does a letter go by e-mail?

Headers: RFC 5322 (threads by Message-ID, In-Reply-To and References), RFC 2919 (List-Id), RFC 3834 (Auto-Submitted).
"""

import smtplib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from email.headerregistry import Address
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import format_datetime

import httpx
from jinja2 import Environment, PackageLoader

from service.notify.letter import DRILL, GRADES, TEST, Addressee, Letter
from service.notify.outcome import Answer, one_line
from service.settings import Settings

COLOURS = {"normal": "#2e7d32", "note": "#14569e", "warning": "#b26a00", "alarm": "#b00020"}
TEMPLATES = Environment(
    loader=PackageLoader("service.notify.channels"), autoescape=True, trim_blocks=True, lstrip_blocks=True
)
NOT_REAL = "#5b21b6"
"""Colour of a drill or a test, which nothing real has."""
FOR_GOOD = range(500, 600)
"""Replies of a mail server that stay the same (RFC 5321, section 4.2.1)."""


def send(letter: Letter, to: Addressee, settings: Settings, now: datetime) -> Answer:
    """Hand a letter to the mail server of the settings.

    Returns:
        `delivered` once the server has taken it over; `unknown` where the connection broke before it said so.
    """
    if settings.smtp.host is None:
        return Answer("not_taken", "no mail server is set; set smtp.host")
    try:
        with _connected(settings) as server:
            answer = _handed_over(server, composed(letter, to.address, settings.smtp.sender, now), to.address)
            if answer.outcome != "unknown":  # a server that fell silent is not waited for again
                with suppress(smtplib.SMTPException, OSError):  # what it has taken, it has
                    server.quit()
            return answer
    except (smtplib.SMTPException, OSError) as error:
        return Answer("not_taken", one_line(f"mail server: {_said(error)}"))


def composed(letter: Letter, to: str, sender: str, now: datetime) -> EmailMessage:
    """The mail of a letter: plain text, HTML, and the picture within that."""
    domain = sender.rpartition("@")[2]
    mail = EmailMessage(policy=SMTP)
    mail["From"] = Address("Menshin", addr_spec=sender)
    mail["To"] = to
    mail["Subject"] = letter.heading
    mail["Date"] = format_datetime(now)
    mail["Message-ID"] = f"<{letter.identity}@{domain}>"
    if letter.identity != letter.first_identity:
        mail["In-Reply-To"] = mail["References"] = f"<{letter.first_identity}@{domain}>"
    mail["Auto-Submitted"] = "auto-generated"
    mail["List-Id"] = f"<{letter.building_code.lower()}.menshin.{domain}>"
    mail["Importance"] = "high" if letter.severity == "alarm" and letter.is_real else "normal"
    mail["Menshin-Kind"] = letter.kind
    mail["Menshin-Repeat"] = "true" if letter.is_repeat else "false"
    mail.set_content(letter.text)
    picture = f"loop.{letter.identity}@{domain}"
    mail.add_alternative(page(letter, picture if letter.picture else None), subtype="html")
    if letter.picture is not None:
        _, html = mail.iter_parts()
        assert isinstance(html, EmailMessage)
        html.add_related(letter.picture, "image", "png", cid=f"<{picture}>", filename="loop.png", disposition="inline")
    return mail


def page(letter: Letter, picture: str | None) -> str:
    """The letter as HTML; `picture` is the content id of its picture."""
    return TEMPLATES.get_template("mail.html").render(
        letter=letter,
        picture=picture,
        mark={"drill": DRILL, "test": TEST}.get(letter.kind),
        grade=GRADES[letter.severity] if letter.is_real else f"a {letter.kind}",
        order=letter.order,
        colour=COLOURS[letter.severity] if letter.is_real else NOT_REAL,
    )


@contextmanager
def _connected(settings: Settings) -> Iterator[smtplib.SMTP]:
    """The mail server, after STARTTLS and a login where the settings want them."""
    assert settings.smtp.host is not None
    place = (settings.smtp.host, settings.smtp.port)
    trust = httpx.create_ssl_context()
    if settings.smtp.security == "tls":
        server: smtplib.SMTP = smtplib.SMTP_SSL(*place, timeout=settings.notify.timeout, context=trust)
    else:
        server = smtplib.SMTP(*place, timeout=settings.notify.timeout)
    try:
        if settings.smtp.security == "starttls":
            server.starttls(context=trust)
        if settings.smtp.user is not None and settings.smtp.password is not None:
            server.login(settings.smtp.user, settings.smtp.password.get_secret_value())
        yield server
    finally:
        server.close()


def _handed_over(server: smtplib.SMTP, mail: EmailMessage, to: str) -> Answer:
    try:
        server.send_message(mail)
    except smtplib.SMTPRecipientsRefused as error:
        code, said = error.recipients[to]
        return Answer("not_taken", one_line(f"{code} {said.decode('utf-8', 'replace')}"), code in FOR_GOOD)
    except smtplib.SMTPDataError as error:
        return Answer("not_taken", one_line(_said(error)), error.smtp_code in FOR_GOOD)
    except (smtplib.SMTPResponseException, smtplib.SMTPNotSupportedError) as error:  # before the mail itself
        return Answer("not_taken", one_line(_said(error)))
    except (smtplib.SMTPException, OSError) as error:
        return Answer("unknown", one_line(f"mail server: {_said(error)}"))
    return Answer("delivered", "the mail server has taken it over")


def _said(error: Exception) -> str:
    if isinstance(error, smtplib.SMTPResponseException):
        text = error.smtp_error
        return f"{error.smtp_code} {text.decode('utf-8', 'replace') if isinstance(text, bytes) else text}"
    return str(error) or type(error).__name__
