"""Mail, as a real mail server gets it."""

import ssl
from collections.abc import Iterator
from datetime import UTC, datetime
from email.message import EmailMessage
from pathlib import Path
from time import sleep

import pytest
import trustme
from receivers import MailServer, mail_server, webhook_server
from rendered_messages import rendered_message

from service.notify.channels import DeliveryResult
from service.notify.channels.mail import send
from service.notify.channels.outbound_http import Reach, posted
from service.notify.rendering import Destination, RenderedMessage
from service.notify.texts import DRILL, TEST
from service.settings import Settings

NOW = datetime(2024, 3, 1, 5, 7, tzinfo=UTC)
PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(256))
TO = Destination("manager", "email", "manager@example.org", None)


@pytest.fixture
def box() -> Iterator[MailServer]:
    with mail_server() as made:
        yield made


def settings(box: MailServer, **other: object) -> Settings:
    usual = {"smtp_host": "localhost", "smtp_port": box.port, "smtp_security": "none", "mail_from": "m@b.example.org"}
    return Settings(**(usual | other))  # type: ignore[arg-type]


def mailed(box: MailServer, one: RenderedMessage) -> EmailMessage:
    assert send(one, TO, settings(box), NOW).outcome == "delivered"
    return box.mails[-1]


def part(mail: EmailMessage, kind: str) -> str:
    return str(next(one for one in mail.walk() if one.get_content_type() == kind).get_content())


def test_a_mail_has_text_html_and_a_picture(box: MailServer) -> None:
    one = rendered_message(picture=PNG)
    mail = mailed(box, one)
    assert mail["Subject"] == "[Tower ö] Earthquake of 1 March 2024, 14:02: normal: 8 of 8 checks passed"
    assert (mail["From"], mail["To"]) == ("Menshin <m@b.example.org>", "manager@example.org")
    assert mail["Message-ID"] == "<msg_2@b.example.org>"
    assert mail["In-Reply-To"] is None
    assert mail["Auto-Submitted"] == "auto-generated"
    assert mail["List-Id"] == "<tower.menshin.b.example.org>"
    for text in (part(mail, "text/plain"), part(mail, "text/html")):
        for printed in (*one.sentences, "Largest displacement", "31 mm", one.link, "2024-03-01 14:06:07", "msg_2"):
            assert printed in text
    [picture] = [found for found in mail.walk() if found.get_content_type() == "image/png"]
    assert picture.get_content() == PNG
    assert f'src="cid:{picture["Content-ID"].strip("<>")}"' in part(mail, "text/html")


def test_html_escapes_its_text_and_shows_no_missing_picture(box: MailServer) -> None:
    html = part(mailed(box, rendered_message(sentences=("<script>a & b</script>",))), "text/html")
    assert "&lt;script&gt;a &amp; b&lt;/script&gt;" in html
    assert "<img" not in html


def test_later_news_joins_the_thread(box: MailServer) -> None:
    mail = mailed(box, rendered_message(identity="msg_9", number=2, sequence="updated"))
    assert mail["Message-ID"] == "<msg_9@b.example.org>"
    assert mail["In-Reply-To"] == mail["References"] == "<msg_2@b.example.org>"
    assert mail["Subject"].startswith("UPDATED: [Tower ö]")
    assert mailed(box, rendered_message(sequence="cancelled"))["Subject"].startswith("CANCELLED: [Tower ö]")


def test_a_repeat_is_marked_and_keeps_its_number(box: MailServer) -> None:
    mail = mailed(box, rendered_message(is_repeat=True))
    assert mail["Subject"].startswith("(repeat) [Tower ö]")
    assert mail["Menshin-Repeat"] == "true"
    assert mail["Message-ID"] == "<msg_2@b.example.org>"
    assert "You may already have received this message" in part(mail, "text/plain")
    assert "You may already have received this message" in part(mail, "text/html")


@pytest.mark.parametrize(("kind", "mark"), [("drill", DRILL), ("test", TEST)])
def test_a_drill_cannot_be_mistaken_for_real(box: MailServer, kind: str, mark: str) -> None:
    mail = mailed(box, rendered_message(kind=kind, severity="alarm", is_repeat=kind == "drill"))
    assert f"{mark}: [Tower ö]" in mail["Subject"]
    assert mail["Menshin-Kind"] == kind
    assert mail["Importance"] == "normal"
    assert part(mail, "text/plain").startswith("This is a ")
    assert mark in part(mail, "text/html")
    real = mailed(box, rendered_message(severity="alarm"))
    assert real["Importance"] == "high"
    assert "NOT REAL" not in real.as_string()


def test_a_subject_stays_one_line(box: MailServer) -> None:
    mail = mailed(box, rendered_message(subject="Earthquake\r\nBcc: all@example.org"))
    assert mail["Subject"] == "[Tower ö] Earthquake Bcc: all@example.org"
    assert mail["Bcc"] is None


@pytest.mark.parametrize(
    ("reply", "answer"),
    [
        ("550 no such mailbox", DeliveryResult("not_taken", "550 no such mailbox", is_final=True)),
        ("451 come back later", DeliveryResult("not_taken", "451 come back later")),
    ],
)
def test_a_recipient_that_is_refused(box: MailServer, reply: str, answer: DeliveryResult) -> None:
    box.refuses[TO.address] = reply
    assert send(rendered_message(), TO, settings(box), NOW) == answer
    assert box.raw == []


@pytest.mark.parametrize(("reply", "is_final"), [("554 spam", True), ("452 full", False)])
def test_a_mail_that_is_refused(box: MailServer, reply: str, is_final: bool) -> None:
    box.after_data = reply
    assert send(rendered_message(), TO, settings(box), NOW) == DeliveryResult("not_taken", reply, is_final)


def test_a_server_that_takes_it_and_does_not_say_so_may_have_it(box: MailServer) -> None:
    box.meanwhile = lambda: sleep(1)
    assert send(rendered_message(), TO, settings(box, notice_timeout=0.3), NOW).outcome == "unknown"
    assert len(box.raw) == 1


def test_without_a_server_nothing_is_taken(box: MailServer) -> None:
    assert "smtp.host" in send(rendered_message(), TO, settings(box, smtp_host=None), NOW).text
    with mail_server() as gone:
        pass
    assert send(rendered_message(), TO, settings(gone), NOW).outcome == "not_taken"


def test_encrypted_and_logged_in_at_a_server_that_is_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    authority = trustme.CA()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("localhost").configure_cert(context)
    with mail_server(context, password="right") as box:
        wanted = settings(box, smtp_security="starttls", smtp_user="menshin", smtp_password="right")
        assert send(rendered_message(), TO, wanted, NOW).outcome == "not_taken", "nobody trusts it yet"
        authority.cert_pem.write_to_path(str(tmp_path / "ca.pem"))
        monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "ca.pem"))
        wrong = settings(box, smtp_security="starttls", smtp_user="menshin", smtp_password="wrong-one")
        answer = send(rendered_message(), TO, wrong, NOW)
        assert (answer.outcome, "wrong-one" in answer.text) == ("not_taken", False)
        assert send(rendered_message(), TO, wanted, NOW).outcome == "delivered"
        assert set(box.logins) == {"menshin"}
        assert len(box.raw) == 1


def test_a_mail_after_a_web_request_does_not_say_that_it_speaks_http(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mail server may refuse a client that announces another protocol (ALPN), as Exim does."""
    authority = trustme.CA()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("localhost").configure_cert(context)
    context.set_alpn_protocols(["http/1.1"])
    authority.cert_pem.write_to_path(str(tmp_path / "ca.pem"))
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "ca.pem"))
    with webhook_server(context) as program, mail_server(context) as box:
        reach = Reach(allowed=("localhost",))
        assert posted(program.address, {}, b"{}", reach, 10.0).outcome == "delivered"
        assert send(rendered_message(), TO, settings(box, smtp_security="starttls"), NOW).outcome == "delivered"
    assert box.protocols == [None]
