"""What an engineer may do about an alert, and when that is refused; repeating it changes nothing."""

from datetime import datetime

from sqlalchemy.orm import Session

from service.alerts.acts import OUTCOMES, Act, Outcome
from service.alerts.states import ACKNOWLEDGED, ACTIVE, MEANINGS, NAMES
from service.alerts.tables import Alert, Inspection, Silence
from service.alerts.transitions import change, follow_act
from service.alerts.words import quantity_of, sensor_of
from service.buildings import reference_periods
from service.buildings.tables import Building
from service.errors import ConflictError


def acknowledge(session: Session, alert: Alert, by: str, note: str, now: datetime) -> None:
    """Take an alert on: others see who looks after it. One that somebody has taken on stays theirs.

    Raises:
        ConflictError: it is not active.
    """
    _held(session, alert)
    if alert.state == ACKNOWLEDGED:
        return
    if alert.state != ACTIVE:
        raise ConflictError(
            f"Alert {alert.id} is {NAMES[alert.state]}: {MEANINGS[alert.state]}; only an active one is acknowledged."
        )
    follow_act(alert, Act(alert.cause, now, by, note, ends=False, evidence=alert.evidence))
    change(alert, ACKNOWLEDGED, by, note, now)


def inspect(
    session: Session, alert: Alert, by: str, outcome: Outcome, note: str, reference_from: datetime | None, now: datetime
) -> Inspection | None:
    """End an alert by what somebody found at the building, or by a review of its data.

    What began before and does not get worse is answered by it. With `reference_from` the quantity that the alert is
    about has a new reference from then on: of a sensor its own, else in every direction:
    the isolators are the same.

    Returns:
        None if the same inspection was told before: then nothing changes.

    Raises:
        ConflictError: it has ended already.
    """
    _held(session, alert)
    for before in alert.inspections:
        if (before.outcome, before.note, before.reference_from) == (outcome, note, reference_from):
            return None
    if alert.closed_at is not None:
        raise ConflictError(f"Alert {alert.id} is {alert.state} since {alert.closed_at:%Y-%m-%d %H:%M} UTC already.")
    made = Inspection(
        alert=alert,
        at=now,
        by=by,
        outcome=outcome,
        note=note,
        reference_from=reference_from,
        evidence=dict(alert.evidence),
    )
    session.add(made)
    change(alert, OUTCOMES[outcome], by, note, now)
    session.flush()
    quantity = quantity_of(alert.cause)
    if reference_from is not None and quantity is not None:
        of, why = sensor_of(alert.cause), f"Inspection of alert {alert.id}: {note}"
        reference_periods.begin(session, alert.building, quantity, of, reference_from, None, why, by, now)
    return made


def silence(
    session: Session, building: Building, pattern: str, until: datetime, reason: str, by: str, now: datetime
) -> Silence:
    """Tell nobody of alerts of such causes for a while; the same again is the silence there is.

    Raises:
        ConflictError: it would end before it begins.
    """
    if until <= now:
        raise ConflictError(f"The silence would have ended at {until:%Y-%m-%d %H:%M} UTC; a time to come would do.")
    session.get_one(Building, building.id, with_for_update=True)
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
    """Tell people again from now on; a silence that has ended stays as it was."""
    if silence.ends_at > now:
        silence.ends_at, silence.ended_by = now, by


def _held(session: Session, alert: Alert) -> None:
    """One after the other: whoever comes second sees what the first one did."""
    session.get_one(Building, alert.building_id, with_for_update=True)
    session.refresh(alert)
