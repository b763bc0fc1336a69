"""What is asked about the years for the sake of drift: the latest analysis of every event, the earliest event first."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.analyses.tables import Analysis, CycleResult, DirectionResult, SensorResult
from service.db.select import Line, Question
from service.drift.tables import ReferencePeriod
from service.records.tables import Event


def temperatures(session: Session, building_id: int) -> Sequence[tuple[int, float]]:
    """Number of each event whose temperature was measured, and °C."""
    question = _analysed(building_id).add_columns(Analysis.temperature).where(Analysis.temperature.is_not(None))
    return [(row.event, row.temperature) for row in session.execute(question)]


def analysed_since(session: Session, building_id: int, since: datetime) -> int:
    """Number of the building's events with a result that began at that time or later."""
    question = _analysed(building_id).where(Event.start >= since).subquery()
    return session.scalar(select(func.count()).select_from(question)) or 0


def cycles(session: Session, building_id: int) -> Sequence[Line]:
    """Every cycle."""
    names = ("start", "end", "amplitude", "k_eq", "k_eq_std", "c_eq", "c_eq_std")
    columns = [CycleResult.__table__.c[name] for name in names]
    question = _in_directions(building_id).add_columns(DirectionResult.start.label("record_start"), *columns)
    joined = question.join(CycleResult, CycleResult.result_id == DirectionResult.id)
    return session.execute(joined.order_by(Event.start, Event.id, CycleResult.id)).all()


def residuals(session: Session, building_id: int) -> Sequence[Line]:
    """Residual displacement of the layer in each direction, m."""
    value, std = DirectionResult.residual_displacement, DirectionResult.residual_displacement_std
    question = _in_directions(building_id).add_columns(value.label("value"), std.label("std"))
    return session.execute(question.where(value.is_not(None)).order_by(Event.start, Event.id)).all()


def peak_displacements(session: Session, building_id: int) -> Sequence[Line]:
    """Of the layer in each direction, m; None where nothing measured it."""
    question = _in_directions(building_id).add_columns(DirectionResult.peak_displacement.label("peak"))
    return session.execute(question.order_by(Event.start, Event.id)).all()


def sensors(session: Session, building_id: int) -> Sequence[Line]:
    """Noise and gain of every channel."""
    columns = (SensorResult.channel, SensorResult.noise, SensorResult.gain, SensorResult.gain_std)
    question = _analysed(building_id).join(SensorResult, SensorResult.analysis_id == Analysis.id).add_columns(*columns)
    return session.execute(question.order_by(Event.start, Event.id, SensorResult.channel)).all()


def findings(session: Session, building_id: int) -> Sequence[Line]:
    """What screening found in each event."""
    question = _analysed(building_id).add_columns(Analysis.quality)
    return session.execute(question.order_by(Event.start, Event.id)).all()


def reference_periods(session: Session, building_id: int) -> Sequence[ReferencePeriod]:
    """Of a building, in the order in which they were set."""
    question = select(ReferencePeriod).where(ReferencePeriod.building_id == building_id)
    return session.scalars(question.order_by(ReferencePeriod.id)).all()


def _in_directions(building_id: int) -> Question:
    joined = _analysed(building_id).join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
    return joined.add_columns(DirectionResult.direction)


def _analysed(building_id: int) -> Question:
    """Events of a building with their latest analysis."""
    columns = (Event.id.label("event"), Event.start.label("event_start"))
    latest = (Analysis.event_id == Event.id) & Analysis.current
    return select(*columns).join(Analysis, latest).where(Event.building_id == building_id)
