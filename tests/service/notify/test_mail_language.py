"""One message, in the language of each recipient, through outbox, notifier and real servers."""

import io
import re
from collections.abc import Iterator
from email.message import EmailMessage
from html import unescape
from random import Random

import pytest
from alert_fixtures import AGE, SOON
from assessed_buildings import building, day, earthquake
from pypdf import PdfReader
from receivers import MailServer, WebhookServer, mail_server, webhook_server
from rendered_messages import KEY
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.messages import write_event_message
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building
from service.language.choice import Language, speaking
from service.notify.drill import drill
from service.notify.notifier import Notifier
from service.notify.tables import Message, Receiver
from service.settings import Settings

pytestmark = pytest.mark.sqlite

JAPANESE = re.compile(r"[\u3040-\u30ff\u4e00-\u9fff]")
ENGLISH = re.compile(r"\b[a-z]{3,}\b")
KEPT = {"gal", "max", "min", "http", "https", "msg"}
"""Units, and words of addresses."""


@pytest.fixture
def box() -> Iterator[MailServer]:
    with mail_server() as made:
        yield made


@pytest.fixture
def program() -> Iterator[WebhookServer]:
    with webhook_server() as made:
        yield made


def person(session: Session, of: Building, language: Language, *, report: bool = False) -> Receiver:
    """A recipient of mail, named by the language."""
    address = f"{language}@example.org"
    rule = ReceiverRule(language, "email", address, None, WANTED_KINDS, SEVERITIES, report, language)
    return recipients.add(session, of.id, rule, "engineer", day(0))


def sent(sessions: sessionmaker[Session], box: MailServer) -> dict[str, EmailMessage]:
    """Send what waits: the mails by language."""
    given = {"smtp_host": "localhost", "smtp_port": box.port, "smtp_security": "none"}
    given |= {"inside_allowed": ("localhost",), "plain_http_allowed": True, "notice_attempts": 1}
    Notifier(sessions, Settings(**given), lambda: day(3), Random(1)).run_until_idle()  # type: ignore[arg-type]
    mails, box.raw[:] = list(box.mails), []
    return {str(mail["To"]).partition("@")[0]: mail for mail in mails}


def parts(mail: EmailMessage) -> tuple[str, str]:
    """Plain text, and the text of the HTML."""
    plain, html = (mail.get_body((kind,)) for kind in ("plain", "html"))
    assert isinstance(plain, EmailMessage)
    assert isinstance(html, EmailMessage)
    shown = re.sub(r"(?s)<head>.*?</head>|<[^>]+>", " ", html.get_content())
    return plain.get_content(), unescape(shown)


def english(text: str, names: tuple[str, ...]) -> set[str]:
    """English words beside names and numbers of messages."""
    for name in names:
        text = text.replace(name, "")
    return set(ENGLISH.findall(re.sub(r"msg_\w+|https?://\S+", "", text))) - KEPT


def test_each_recipient_reads_the_same_message_in_their_language(
    sessions: sessionmaker[Session], box: MailServer, program: WebhookServer
) -> None:
    with sessions.begin() as session:
        of = building(session)
        person(session, of, "en")
        person(session, of, "ja", report=True)
        hook = ReceiverRule("hook", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES)
        recipients.add(session, of.id, hook, "engineer", day(0))
        event = earthquake(session, of, day(1))
        write_event_message(session, event.id, AGE, event.end + SOON)
        name = of.name
    mails = sent(sessions, box)
    assert mails.keys() == {"en", "ja"}
    with sessions() as session:
        message = session.query(Message).one()
        assert mails["en"]["Subject"] == f"[{name}] {message.subject}"
        for sentence in message.sentences:
            assert all(sentence in text for text in parts(mails["en"]))
    subject = str(mails["ja"]["Subject"])
    assert subject.startswith(f"[{name}] ")
    assert "の地震：" in subject
    assert mails["ja"]["Menshin-Kind"] == mails["en"]["Menshin-Kind"]
    for text in (subject, *parts(mails["ja"])):
        assert JAPANESE.search(text)
        assert english(text, (name, "ground", "roof")) == set(), text
    [report] = [one.get_content() for one in mails["ja"].walk() if one.get_content_type() == "application/pdf"]
    assert JAPANESE.search(PdfReader(io.BytesIO(report)).pages[0].extract_text())
    assert not any(JAPANESE.search(one.body.decode()) for one in program.posted)


def test_a_drill_is_marked_in_the_language_of_the_recipient(sessions: sessionmaker[Session], box: MailServer) -> None:
    with sessions.begin() as session:
        of = building(session)
        person(session, of, "en")
        person(session, of, "ja")
        drill(session, of, "Jo", day(2))
        name = of.name
    mails = sent(sessions, box)
    assert mails["en"]["Subject"] == f"DRILL – NOT REAL: [{name}] An alarm, as a drill"
    assert mails["ja"]["Subject"] == f"訓練 – 実際の警報ではありません: [{name}] 警報の訓練"
    plain, shown = parts(mails["ja"])
    assert plain.startswith("これは訓練です。")
    assert "訓練 – 実際の警報ではありません" in shown
    assert english(plain + shown, (name,)) == set()


def test_what_is_no_news_is_none_whatever_the_language(sessions: sessionmaker[Session], box: MailServer) -> None:
    with sessions.begin() as session:
        of = building(session)
        receiver = person(session, of, "ja")
        event = earthquake(session, of, day(1))
        write_event_message(session, event.id, AGE, event.end + SOON)
    assert sent(sessions, box).keys() == {"ja"}
    with sessions.begin() as session:
        session.get_one(Receiver, receiver.id).language = "en"
        with speaking("ja"):
            write_event_message(session, event.id, AGE, event.end + SOON)
        assert session.query(Message).count() == 1
    assert sent(sessions, box) == {}
