"""The report on an earthquake in a mail, through outbox, notifier and a real mail server."""

import io
from collections.abc import Iterator
from random import Random

import pytest
from alert_fixtures import AGE, SOON
from assessed_buildings import building, day, earthquake
from pypdf import PdfReader
from receivers import MailServer, mail_server
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.messages import write_event_message
from service.analyses.tables import Analysis, DirectionResult
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building
from service.notify.drill import drill
from service.notify.notifier import Notifier
from service.records.tables import Event
from service.settings import Settings

pytestmark = pytest.mark.sqlite


@pytest.fixture
def box() -> Iterator[MailServer]:
    with mail_server() as made:
        yield made


def sent(sessions: sessionmaker[Session], box: MailServer) -> dict[str, list[tuple[str, str]]]:
    """Send what waits: by recipient, names and first pages of the attached reports."""
    smtp = {"smtp_host": "localhost", "smtp_port": box.port, "smtp_security": "none"}
    Notifier(sessions, Settings(**smtp), lambda: day(3), Random(1)).run_until_idle()
    mails, box.raw[:] = list(box.mails), []
    return {
        str(mail["To"]): [
            (str(one.get_filename()), PdfReader(io.BytesIO(one.get_content())).pages[0].extract_text())
            for one in mail.walk()
            if one.get_content_type() == "application/pdf"
        ]
        for mail in mails
    }


def shaken(session: Session) -> tuple[Building, Event]:
    """A building with an earthquake, a recipient of reports, and one of messages alone."""
    of = building(session)
    for name, report in (("with", True), ("without", False)):
        rule = ReceiverRule(name, "email", f"{name}@example.org", None, WANTED_KINDS, SEVERITIES, report)
        recipients.add(session, of.id, rule, "engineer", day(0))
    return of, earthquake(session, of, day(1))


def test_who_wants_the_report_gets_it_with_the_message_and_stamped_with_a_drill(
    sessions: sessionmaker[Session], box: MailServer
) -> None:
    with sessions.begin() as session:
        of, event = shaken(session)
        code = of.code
        write_event_message(session, event.id, AGE, event.end + SOON)
    found = sent(sessions, box)
    assert found.keys() == {"with@example.org", "without@example.org"}
    assert found["without@example.org"] == []
    [(name, text)] = found["with@example.org"]
    assert name == f"{code}-{day(1):%Y-%m-%dT%H%M%SZ}-report.pdf"
    assert "Earthquake report" in text
    assert "UNDECIDED" in text
    assert "NOT REAL" not in text
    with sessions.begin() as session:
        message = drill(session, session.query(Building).one(), "Jo", day(3))
        message.picture_event_id = session.query(Event.id).order_by(Event.start.desc()).limit(1).scalar()
    [(_, stamped)] = sent(sessions, box)["with@example.org"]
    assert "DRILL – NOT REAL" in stamped.split("Earthquake report")[0]


def test_a_message_is_sent_even_if_its_report_cannot_be_made(
    sessions: sessionmaker[Session], box: MailServer, caplog: pytest.LogCaptureFixture
) -> None:
    with sessions.begin() as session:
        _, event = shaken(session)
        write_event_message(session, event.id, AGE, event.end + SOON)
        for one in session.query(DirectionResult).join(Analysis).filter(Analysis.event_id == event.id):
            one.displacement = b"d\x00\x01damaged"
    smtp = {"smtp_host": "localhost", "smtp_port": box.port, "smtp_security": "none"}
    Notifier(sessions, Settings(**smtp), lambda: day(3), Random(1)).run_until_idle()
    bodies = {str(mail["To"]): mail.get_body(("plain",)).get_content() for mail in box.mails}  # type: ignore[union-attr]
    assert "could not be made" in bodies["with@example.org"]
    assert "could not be made" not in bodies["without@example.org"]
    assert "the report on event" in caplog.text
