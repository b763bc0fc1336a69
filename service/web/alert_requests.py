"""What an engineer may ask of an alert, by the API or a page: done and told in one transaction."""

from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from service.access.auth import Caller
from service.alerting import handling
from service.alerting.acts import Outcome
from service.alerting.event_messages import tell
from service.database import Alert, Silence
from service.queries import watched
from service.queue import jobs


def person(by: Caller, name: str | None) -> str:
    """Who acts: the key's name, and the person's where that is another."""
    return by.name if name is None or name == by.name else f"{name} ({by.name})"


def inspect(
    session: Session,
    alert: Alert,
    by: str,
    outcome: Outcome,
    note: str,
    reference_from: datetime | None,
    message_age: timedelta,
    now: datetime,
) -> None:
    """End an alert by what was found, and tell those who were told of it, once it is known what that changes.

    Raises:
        ConflictError: it has ended already.
    """
    if handling.inspect(session, alert, by, outcome, note, reference_from, now) is None:
        return
    if alert.kind != "data":
        jobs.enqueue_watch(session, alert.building_id, by, now)  # what was on hold for it may become active now
    session.flush()
    tell(session, alert.building_id, message_age, now)


def silence(session: Session, code: str, pattern: str, until: datetime, reason: str, by: str, now: datetime) -> Silence:
    """Tell nobody of alerts of such causes for a while.

    Raises:
        NotFoundError: there is no such building.
        ConflictError: it would end before it begins.
    """
    building, _ = watched.building(session, code)
    return handling.silence(session, building, pattern, until, reason, by, now)
