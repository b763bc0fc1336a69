"""What an engineer may ask of an alert, by the API or a page: done and told in one transaction."""

from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from service.access.auth import Caller
from service.alerts import operator_actions
from service.alerts.acts import Outcome
from service.alerts.event_messages import tell
from service.alerts.tables import Alert, Silence
from service.buildings import queries as building_queries
from service.jobs import queue as job_queue


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
    if operator_actions.inspect(session, alert, by, outcome, note, reference_from, now) is None:
        return
    if alert.kind != "data":
        job_queue.enqueue_watch(session, alert.building_id, by, now)  # what was on hold for it may become active now
    session.flush()
    tell(session, alert.building_id, message_age, now)


def silence(session: Session, code: str, pattern: str, until: datetime, reason: str, by: str, now: datetime) -> Silence:
    """Tell nobody of alerts of such causes for a while.

    Raises:
        NotFoundError: there is no such building.
        ConflictError: it would end before it begins.
    """
    building, _ = building_queries.building(session, code)
    return operator_actions.silence(session, building, pattern, until, reason, by, now)
