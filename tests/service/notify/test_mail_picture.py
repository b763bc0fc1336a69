"""The script of docs/operate/mail.png renders a stored message as the notifier mails it."""

import importlib.util
from pathlib import Path

import pytest
from alert_fixtures import AGE, SOON
from assessed_buildings import building, day, earthquake
from markupsafe import escape
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.messages import write_event_message
from service.notify.tables import Delivery, Message

pytestmark = pytest.mark.sqlite

SCRIPT = importlib.util.spec_from_file_location(
    "write_mail", Path(__file__).resolve().parents[3] / "docs" / "tools" / "write_mail.py"
)
assert SCRIPT is not None
assert SCRIPT.loader is not None
writer = importlib.util.module_from_spec(SCRIPT)
SCRIPT.loader.exec_module(writer)


def test_a_message_without_a_recipient_is_rendered(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        event = earthquake(session, building(session), day(1))
        write_event_message(session, event.id, AGE, event.end + SOON)
        (subject,) = session.scalars(select(Message.subject))
        assert session.query(Delivery).count() == 0
    assert escape(subject) in writer.page(database_url, 1)
