"""The script of docs/operate/mail.png renders a stored message as its recipient gets it."""

import importlib.util
from pathlib import Path

import pytest
import stored_histories
import typer
from alert_fixtures import AGE, SOON
from assessed_buildings import building, day, earthquake
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.messages import write_event_message
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.notify import drill

pytestmark = pytest.mark.sqlite

SCRIPT = importlib.util.spec_from_file_location(
    "write_mail", Path(__file__).resolve().parents[3] / "docs" / "tools" / "write_mail.py"
)
assert SCRIPT is not None
assert SCRIPT.loader is not None
writer = importlib.util.module_from_spec(SCRIPT)
SCRIPT.loader.exec_module(writer)


def test_a_message_is_rendered_as_its_recipient_gets_it(database_url: str, sessions: sessionmaker[Session]) -> None:
    manager = ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES)
    with sessions.begin() as session:
        receiver = recipients.add(session, stored_histories.building(session).id, manager, "engineer", day(0))
        drill.trial(session, receiver, "engineer", day(1))
    assert "A test of manager" in writer.page(database_url, 1)


def test_a_message_to_no_recipient_is_refused(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        event = earthquake(session, building(session), day(1))
        write_event_message(session, event.id, AGE, event.end + SOON)
    with pytest.raises(typer.BadParameter, match="went to no recipient"):
        writer.page(database_url, 1)
