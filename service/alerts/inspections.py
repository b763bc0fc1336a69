"""Inspections of a building that a person signs: recorded, never changed; they end the alert about exceeded limits."""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.alerts import operator_actions, queries, texts
from service.alerts.tables import Alert, BuildingInspection
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.errors import ConflictError
from service.verdict import levels, reading, texts as verdict_texts
from service.verdict.assessment import Result


def record(
    session: Session,
    building: Building,
    by: str,
    result: Result,
    comment: str,
    inspected_at: datetime,
    max_age: timedelta,
    now: datetime,
) -> BuildingInspection:
    """Record an inspection; the same one again changes nothing.

    With the result `fit` it ends the alert about exceeded limits, if all its earthquakes ended before the inspection.
    Other alerts stay: an inspection of their own ends them.

    Args:
        session: of the transaction.
        building: that was inspected.
        by: who signs it.
        result: of the inspection.
        comment: findings and restrictions.
        inspected_at: when it was made.
        max_age: of an earthquake without alerts that is still reported, settings.notify.max_event_age.
        now: aware time.

    Raises:
        ConflictError: it lies in the future.
    """
    if inspected_at > now:
        raise ConflictError(texts.INSPECTION_IN_THE_FUTURE.format(at=inspected_at))
    locked(session, building.id)
    for before in inspections(session, building.id):
        if (before.by, before.result, before.comment, before.inspected_at) == (by, result, comment, inspected_at):
            return before
    verdict = reading.of_building(session, building)
    made = BuildingInspection(
        building_id=building.id,
        inspected_at=inspected_at,
        recorded_at=now,
        by=by,
        result=result.value,
        comment=comment,
        level=verdict.automatic.value,
        headline=verdict_texts.headline(verdict),
    )
    session.add(made)
    session.flush()
    if result is Result.FIT:
        for alert in _limit_alerts(session, building.id, inspected_at):
            operator_actions.inspect_and_notify(
                session, alert, by, "confirmed", comment, None, max_age, now, inspected_at=inspected_at
            )
    levels.store(session, [building.id], now)
    return made


def inspections(session: Session, building_id: int) -> Sequence[BuildingInspection]:
    """Inspections of a building, the latest first."""
    query = select(BuildingInspection).where(BuildingInspection.building_id == building_id)
    return session.scalars(query.order_by(BuildingInspection.inspected_at.desc(), BuildingInspection.id.desc())).all()


def _limit_alerts(session: Session, building_id: int, inspected_at: datetime) -> Sequence[Alert]:
    """The open alert about exceeded limits, if the inspection was made after its last earthquake."""
    alerts = [one for one in queries.open_alerts(session, building_id, ("limit",)) if one.cause == texts.LIMITS]
    return [one for one in alerts if one.raised_event is None or one.raised_event.end <= inspected_at]
