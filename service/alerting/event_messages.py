"""What people are told after an earthquake, and when they are told again."""

from datetime import datetime, timedelta

from sqlalchemy.orm import Session


def tell_of_event(session: Session, event_id: int, message_age: timedelta, now: datetime) -> None:
    """Tell people of an event what is known now, unless that was said already.

    An event that ended longer ago than `message_age` is told of only where it raised an alert, so that an import of
    years is silent but for those.

    Args:
        session: of the transaction in which what is told is stored.
        event_id: of the event.
        message_age: settings.message_age.
        now: aware time.
    """
