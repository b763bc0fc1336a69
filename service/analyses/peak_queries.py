"""Questions about how far the isolators of a building moved in its earthquakes, by the latest analysis of each."""

from collections.abc import Collection, Sequence
from datetime import datetime

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert, AlertChange, Inspection
from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.db.select import Line, Question
from service.drift.tables import DriftValue, WatchedSeries
from service.records.tables import Event


def largest_before(session: Session, event: Event) -> float | None:
    """m, largest displacement in plan in the building's earthquakes before this one; None where none was measured."""
    moved = func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement)
    question = _moved(event.building_id).with_only_columns(func.max(moved)).where(Event.start < event.start)
    return session.scalar(question)


def moved_far(
    session: Session, building_id: int, since: datetime | None, displacement: float, residual: float
) -> Sequence[Line]:
    """(Event, Analysis) of the building's earthquakes in which one direction moved so far, the earliest first.

    Args:
        session: to read with.
        building_id: of the building.
        since: those that ended before do not count; None: all count.
        displacement: m, in one direction.
        residual: m, in one direction.
    """
    far = or_(
        DirectionResult.peak_displacement >= displacement, func.abs(DirectionResult.residual_displacement) >= residual
    )
    question = _moved(building_id).with_only_columns(Event.id).where(far)
    if since is not None:
        question = question.where(Event.end > since)
    both = select(Event, Analysis).join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
    return session.execute(both.where(Event.id.in_(question)).order_by(Event.start, Event.id)).all()


def last_inspection(session: Session, building_id: int, cause: str) -> datetime | None:
    """Time of the last inspection that ended an alert of that cause; None where there was none."""
    of_cause = (Alert.building_id == building_id, Alert.cause == cause)
    return session.scalar(select(func.max(Inspection.at)).join(Alert, Alert.id == Inspection.alert_id).where(*of_cause))


def stiffness_values(session: Session, event: Event) -> Sequence[Line]:
    """(subject, wanted, DriftValue | None): the building's series of stiffness, with the event's value in each."""
    value = (DriftValue.series_id == WatchedSeries.id) & (DriftValue.event_id == event.id)
    of_stiffness = (WatchedSeries.building_id == event.building_id, WatchedSeries.quantity == "stiffness")
    question = select(WatchedSeries.subject, WatchedSeries.wanted, DriftValue).outerjoin(DriftValue, value)
    return session.execute(question.where(*of_stiffness).order_by(WatchedSeries.subject)).all()


def open_at(session: Session, building_id: int, at: datetime | None) -> Sequence[tuple[Alert, str]]:
    """(alert, its state then) of the building's alerts that were open at a time, or are now (None), by number."""
    if at is None:
        now_open = select(Alert).where(Alert.building_id == building_id, Alert.closed_at.is_(None)).order_by(Alert.id)
        return [(one, one.state) for one in session.scalars(now_open)]
    was_open = (
        Alert.building_id == building_id,
        Alert.opened_at <= at,
        or_(Alert.closed_at.is_(None), Alert.closed_at > at),
    )
    found = session.scalars(select(Alert).where(*was_open).order_by(Alert.id)).all()
    states = _states(session, [one.id for one in found], at)
    return [(one, states.get(one.id, one.state)) for one in found]


def ended(session: Session, building_id: int) -> Sequence[Alert]:
    """Alerts of the building that have ended and that people were told of, by number."""
    has_ended = (Alert.building_id == building_id, Alert.closed_at.is_not(None), Alert.activated_at.is_not(None))
    return session.scalars(select(Alert).where(*has_ended).order_by(Alert.id)).all()


def _states(session: Session, numbers: Collection[int], at: datetime) -> dict[int, str]:
    """By alert, its state at that time."""
    question = select(AlertChange.alert_id, AlertChange.state).where(AlertChange.alert_id.in_(numbers))
    changes = session.execute(question.where(AlertChange.at <= at).order_by(AlertChange.id))
    return {change.alert_id: change.state for change in changes}


def _moved(building_id: int) -> Question:
    """Directions of the latest usable analysis of every event of a building."""
    return (
        select(Event)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current & Analysis.refusal.is_(None))
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .outerjoin(LayerResult, LayerResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id)
    )
