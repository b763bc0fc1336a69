"""Messages by e-mail.

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

from service.documents.html import rendered
from service.notify import texts
from service.notify.channels import DeliveryResult, one_line
from service.notify.rendering import Destination, RenderedMessage
from service.settings import Settings
from service.tls import tls_context

COLOURS = {"normal": "#2e7d32", "note": "#14569e", "warning": "#b26a00", "alarm": "#b00020"}
NOT_REAL_COLOUR = "#5b21b6"
"""Colour of drills and tests only."""
PERMANENT = range(500, 600)
"""Reply codes of permanent errors (RFC 5321, section 4.2.1)."""


def send(message: RenderedMessage, to: Destination, settings: Settings, now: datetime) -> DeliveryResult:
    """Hand a message to the mail server of the settings.

    Returns:
        `delivered` once the server has accepted it; `unknown` if the connection broke before its reply.
    """
    if settings.smtp.host is None:
        return DeliveryResult("not_taken", "no mail server is set; set smtp.host")
    try:
        with connected(settings) as server:
            result = _handed_over(server, composed(message, to.address, settings.smtp.sender, now), to.address)
            if result.outcome != "unknown":  # do not wait for a silent server again
                with suppress(smtplib.SMTPException, OSError):  # the mail is accepted already
                    server.quit()
            return result
    except (smtplib.SMTPException, OSError) as error:
        return DeliveryResult("not_taken", one_line(f"mail server: {reply(error)}"))


def composed(message: RenderedMessage, to: str, sender: str, now: datetime) -> EmailMessage:
    """The mail of a message: plain text, HTML with the picture, and the report."""
    domain = sender.rpartition("@")[2]
    mail = EmailMessage(policy=SMTP)
    mail["From"] = Address(texts.SENDER, addr_spec=sender)
    mail["To"] = to
    mail["Subject"] = message.heading
    mail["Date"] = format_datetime(now)
    mail["Message-ID"] = f"<{message.identity}@{domain}>"
    if message.identity != message.first_identity:
        mail["In-Reply-To"] = mail["References"] = f"<{message.first_identity}@{domain}>"
    mail["Auto-Submitted"] = "auto-generated"
    mail["List-Id"] = f"<{message.building_code.lower()}.menshin.{domain}>"
    mail["Importance"] = "high" if message.severity == "alarm" and message.is_real else "normal"
    mail["Menshin-Kind"] = message.kind
    mail["Menshin-Repeat"] = "true" if message.is_repeat else "false"
    mail.set_content(message.text)
    picture = f"loop.{message.identity}@{domain}"
    mail.add_alternative(page(message, picture if message.picture else None), subtype="html")
    if message.picture is not None:
        _, html = mail.iter_parts()
        assert isinstance(html, EmailMessage)
        html.add_related(message.picture, "image", "png", cid=f"<{picture}>", filename="loop.png", disposition="inline")
    if message.report is not None:
        mail.add_attachment(message.report.content, "application", "pdf", filename=message.report.name)
    return mail


def page(message: RenderedMessage, picture: str | None) -> str:
    """The message as HTML; `picture` is the content id of its picture."""
    return rendered(
        "notify/channels/templates/mail.html",
        message=message,
        picture=picture,
        mark=texts.MARKS.get(message.kind),
        severity=texts.SEVERITIES[message.severity] if message.is_real else texts.NOT_REAL_SEVERITIES[message.kind],
        colour=COLOURS[message.severity] if message.is_real else NOT_REAL_COLOUR,
    )


@contextmanager
def connected(settings: Settings) -> Iterator[smtplib.SMTP]:
    """The mail server, after STARTTLS and a login if the settings ask for them."""
    assert settings.smtp.host is not None
    place = (settings.smtp.host, settings.smtp.port)
    trust = tls_context("smtp")
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


def _handed_over(server: smtplib.SMTP, mail: EmailMessage, to: str) -> DeliveryResult:
    try:
        server.send_message(mail)
    except smtplib.SMTPRecipientsRefused as error:
        code, said = error.recipients[to]
        return DeliveryResult("not_taken", one_line(f"{code} {said.decode('utf-8', 'replace')}"), code in PERMANENT)
    except smtplib.SMTPDataError as error:
        return DeliveryResult("not_taken", one_line(reply(error)), error.smtp_code in PERMANENT)
    except (smtplib.SMTPResponseException, smtplib.SMTPNotSupportedError) as error:  # before the mail itself
        return DeliveryResult("not_taken", one_line(reply(error)))
    except (smtplib.SMTPException, OSError) as error:
        return DeliveryResult("unknown", one_line(f"mail server: {reply(error)}"))
    return DeliveryResult("delivered", "accepted by the mail server")


def reply(error: Exception) -> str:
    """The server's reply, or the problem of the connection."""
    if isinstance(error, smtplib.SMTPResponseException):
        text = error.smtp_error
        return f"{error.smtp_code} {text.decode('utf-8', 'replace') if isinstance(text, bytes) else text}"
    return str(error) or type(error).__name__
