"""The script of docs/operate/mail.png renders a stored message as the notifier mails it."""

import pytest
import write_mail
from alert_fixtures import AGE, SOON
from assessed_buildings import building, day, earthquake
from markupsafe import escape
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.messages import write_event_message
from service.notify.tables import Delivery, Message

pytestmark = pytest.mark.sqlite


def test_a_message_without_a_recipient_is_rendered(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        event = earthquake(session, building(session), day(1))
        write_event_message(session, event.id, AGE, event.end + SOON)
        (subject,) = session.scalars(select(Message.subject))
        assert session.query(Delivery).count() == 0
    assert escape(subject) in write_mail.page(database_url, 1)
