"""What is asked about the years: cycles and modes of all events."""

from collections.abc import Sequence

from sqlalchemy import select, tuple_
from sqlalchemy.orm import Session

from service.analyses.tables import Analysis, CycleResult, DirectionResult, ModeResult
from service.db.select import Line, Place, Question, Span
from service.records.tables import Event

CYCLE = ("start", "end", "amplitude", "shear_strain", "k_eq", "k_eq_std", "c_eq", "c_eq_std")
MODE = ("number", "frequency", "frequency_std", "damping_ratio", "damping_ratio_std")


def cycles(
    session: Session, building_id: int, span: Span, direction: str | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """Every cycle of every event's latest analysis, the earliest first; the last column is the cycle's id."""
    question = _cycles(building_id, span, direction)
    if cursor is not None:
        question = question.where(tuple_(Event.start, CycleResult.id) > tuple_(cursor.time, cursor.id))
    return session.execute(question.order_by(Event.start, CycleResult.id).limit(limit)).all()


def latest_cycles(session: Session, building_id: int, direction: str, limit: int) -> Sequence[Line]:
    """The latest so many cycles, the earliest of them first; columns as those of `cycles`."""
    question = _cycles(building_id, Span(), direction)
    latest = session.execute(question.order_by(Event.start.desc(), CycleResult.id.desc()).limit(limit)).all()
    return latest[::-1]


def modes(
    session: Session, building_id: int, span: Span, direction: str | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """Every mode of every event's latest analysis, the earliest first; the last column is the mode's id."""
    of_mode = [ModeResult.__table__.c[name] for name in MODE]
    question = _results(building_id, span, direction).add_columns(*of_mode)
    question = question.join(ModeResult, ModeResult.result_id == DirectionResult.id).add_columns(ModeResult.id)
    if cursor is not None:
        question = question.where(tuple_(Event.start, ModeResult.id) > tuple_(cursor.time, cursor.id))
    return session.execute(question.order_by(Event.start, ModeResult.id).limit(limit)).all()


def _cycles(building_id: int, span: Span, direction: str | None) -> Question:
    """Every cycle of every event's latest analysis; the last column is the cycle's id."""
    of_cycle = [CycleResult.__table__.c[name] for name in CYCLE]
    question = _results(building_id, span, direction).add_columns(
        DirectionResult.start.label("record_start"), *of_cycle
    )
    return question.join(CycleResult, CycleResult.result_id == DirectionResult.id).add_columns(CycleResult.id)


def _results(building_id: int, span: Span, direction: str | None) -> Question:
    """Events of a building with a direction of their latest analysis."""
    question = (
        select(Event.id.label("event"), Event.start.label("event_start"), DirectionResult.direction)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id)
    )
    return span.limit(question if direction is None else question.where(DirectionResult.direction == direction))
