"""Actions of engineers on an alert: acknowledge, inspect, silence. Repeating an action changes nothing."""

from collections.abc import Mapping
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from core.drift.baseline import FEWEST_EVENTS
from service.access.auth import Caller
from service.alerts import texts
from service.alerts.lifecycle import ACKNOWLEDGED, ACTIVE, OUTCOMES, OperatorAction, Outcome
from service.alerts.messages import write_messages
from service.alerts.reconciliation import record_acknowledgement, record_change
from service.alerts.schema import AS_BEFORE, FROM_NOW, SINCE_IT_BEGAN
from service.alerts.tables import Alert, AlertComment, Inspection, Silence
from service.analyses import history
from service.buildings import reference_periods
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.errors import ConflictError
from service.jobs import queue as job_queue
from service.verdict.texts import STATE_NAMES


def person_name(by: Caller, name: str | None) -> str:
    """Name of the key, with the person's name where that is another."""
    return by.name if name is None or name == by.name else f"{name} ({by.name})"


def acknowledge(session: Session, alert: Alert, by: str, note: str, now: datetime) -> None:
    """Acknowledge an alert, so that others see who looks after it; an acknowledged alert stays with its person.

    Raises:
        ConflictError: it is not active.
    """
    _lock(session, alert)
    if alert.state == ACKNOWLEDGED:
        return
    if alert.state != ACTIVE:
        state, meaning = STATE_NAMES[alert.state], texts.STATE_MEANINGS[alert.state]
        raise ConflictError(texts.NOT_ACTIVE.format(id=alert.id, state=state, meaning=meaning))
    record_acknowledgement(alert, OperatorAction(alert.cause, now, by, note, ends=False, evidence=alert.evidence))
    record_change(alert, ACKNOWLEDGED, by, note, now)


def comment(session: Session, alert: Alert, by: str, text: str, assigned_to: str | None, now: datetime) -> None:
    """Comment on an alert, and assign it to a person unless `assigned_to` is None; the same again changes nothing.

    Raises:
        ConflictError: it is to be assigned, but has ended.
    """
    _lock(session, alert)
    last = alert.comments[-1] if alert.comments else None
    if last is not None and (last.by, last.text, last.assigned_to) == (by, text, assigned_to):
        return
    if assigned_to is not None:
        if alert.closed_at is not None:
            raise ConflictError(texts.HAS_ENDED.format(id=alert.id, state=alert.state, closed_at=alert.closed_at))
        alert.assigned_to = assigned_to
    alert.comments.append(AlertComment(at=now, by=by, text=text, assigned_to=assigned_to))
    session.flush()


def inspect(
    session: Session,
    alert: Alert,
    by: str,
    outcome: Outcome,
    note: str,
    reference_from: datetime | None,
    now: datetime,
    *,
    inspected_at: datetime | None = None,
) -> Inspection | None:
    """End an alert by an inspection of the building, or by a review of its data.

    The inspection covers what began before, unless it gets worse. `reference_from` begins a new reference period for
    the alert's quantity: that of the one sensor, or of all directions, since the isolators are the same. `inspected_at`
    is the time of the inspection, if that is not now.

    Returns:
        None if the same inspection is recorded already: then nothing changes.

    Raises:
        ConflictError: the alert has ended already.
    """
    _lock(session, alert)
    for before in alert.inspections:
        if (before.outcome, before.note, before.reference_from) == (outcome, note, reference_from):
            return None
    if alert.closed_at is not None:
        raise ConflictError(texts.HAS_ENDED.format(id=alert.id, state=alert.state, closed_at=alert.closed_at))
    made = Inspection(
        alert=alert,
        at=inspected_at or now,
        by=by,
        outcome=outcome,
        note=note,
        reference_from=reference_from,
        evidence=dict(alert.evidence),
    )
    session.add(made)
    record_change(alert, OUTCOMES[outcome], by, note, now)
    session.flush()
    quantity = texts.quantity_of(alert.cause)
    if reference_from is not None and quantity is not None:
        sensor, why = texts.sensor_of(alert.cause), texts.REFERENCE_REASON.format(id=alert.id, note=note)
        reference_periods.begin(session, alert.building, quantity, sensor, reference_from, None, why, by, now)
    return made


def inspect_and_notify(
    session: Session,
    alert: Alert,
    by: str,
    outcome: Outcome,
    note: str,
    reference_from: datetime | None,
    max_age: timedelta,
    now: datetime,
    *,
    inspected_at: datetime | None = None,
) -> None:
    """End an alert by an inspection, and write the messages that follow from it; arguments as those of `inspect`.

    Raises:
        ConflictError: the alert has ended already.
    """
    if inspect(session, alert, by, outcome, note, reference_from, now, inspected_at=inspected_at) is None:
        return
    if alert.kind != "data":
        job_queue.enqueue_monitoring(session, alert.building_id, by, now)  # what it kept on hold may become active
    session.flush()
    write_messages(session, alert.building_id, max_age, now)


def reference_from(alert: Alert, choice: str, now: datetime) -> datetime | None:
    """Start of the new reference period; None: none begins.

    Raises:
        KeyError: there is no such choice.
    """
    return {
        AS_BEFORE: None,
        FROM_NOW: now,
        SINCE_IT_BEGAN: alert.changed_by or alert.began_at,  # earlier events may not have shown it
    }[choice]


def reference_consequences(session: Session, alert: Alert, zone: ZoneInfo) -> Mapping[str, str]:
    """The effect of each choice on later alarms; empty for alerts without a reference period."""
    quantity = texts.quantity_of(alert.cause)
    if quantity is None:
        return {}
    sensor = texts.sensor_of(alert.cause)
    title = texts.TITLES[quantity].format(sensor=sensor)
    shared = texts.ALL_DIRECTIONS_SHARE if sensor is None else texts.OTHER_SENSORS_KEEP
    since = alert.changed_by or alert.began_at
    count = history.analysed_since(session, alert.building_id, since)
    return {
        AS_BEFORE: texts.REFERENCE_STAYS,
        FROM_NOW: texts.REFERENCE_FROM_NOW.format(title=title, needed=FEWEST_EVENTS, shared=shared),
        SINCE_IT_BEGAN: texts.REFERENCE_SINCE_IT_BEGAN.format(
            when=texts.local_time(since.astimezone(zone)),
            counted=texts.ONE_COUNTS if count == 1 else texts.SEVERAL_COUNT.format(count=count),
            title=title,
            needed=max(0, FEWEST_EVENTS - count),
            shared=shared,
        ),
    }


def silence(
    session: Session, building: Building, pattern: str, until: datetime, reason: str, by: str, now: datetime
) -> Silence:
    """Send no messages about alerts of such causes for a while; an equal silence is returned, not repeated.

    Raises:
        ConflictError: it would end before it begins.
    """
    if until <= now:
        raise ConflictError(texts.SILENCE_IN_THE_PAST.format(until=until))
    locked(session, building.id)
    alike = (Silence.building_id == building.id, Silence.pattern == pattern, Silence.reason == reason)
    for before in session.query(Silence).where(*alike, Silence.by == by, Silence.ends_at == until):
        return before
    made = Silence(
        building_id=building.id, pattern=pattern, starts_at=now, ends_at=until, reason=reason, by=by, created_at=now
    )
    session.add(made)
    session.flush()
    return made


def end_silence(silence: Silence, by: str, now: datetime) -> None:
    """Send messages again from now on; a silence that has ended stays as it was."""
    if silence.ends_at > now:
        silence.ends_at, silence.ended_by = now, by


def _lock(session: Session, alert: Alert) -> None:
    """Serialise actions on a building's alerts: the second one sees what the first one did."""
    locked(session, alert.building_id)
    session.refresh(alert)
