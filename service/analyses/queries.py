"""What is asked about the results of one analysis."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session, selectinload

from service.analyses.tables import Analysis, CycleResult, DirectionResult
from service.buildings.tables import Building
from service.db.select import Line, Question
from service.errors import NotFoundError
from service.records.tables import Event


def direction_results(session: Session, analysis_id: int) -> Sequence[DirectionResult]:
    """What an analysis found, by direction, with modes; without histories."""
    question = select(DirectionResult).options(selectinload(DirectionResult.modes))
    return session.scalars(
        question.where(DirectionResult.analysis_id == analysis_id).order_by(DirectionResult.direction)
    ).all()


def peaks(session: Session, analyses: Sequence[int]) -> Mapping[tuple[int, str], tuple[float | None, float]]:
    """Largest displacement (m, None where it was not measured) and restoring force (N), by analysis and direction."""
    columns = (
        DirectionResult.analysis_id,
        DirectionResult.direction,
        DirectionResult.peak_displacement,
        DirectionResult.peak_force,
    )
    found = session.execute(select(*columns).where(DirectionResult.analysis_id.in_(analyses)))
    return {(analysis, direction): (displacement, force) for analysis, direction, displacement, force in found}


def cycle_counts(session: Session, analysis_id: int) -> Mapping[int, int]:
    """Number of cycles that an analysis found, by its direction results' ids; those without any are not in it."""
    question = select(CycleResult.result_id, func.count()).group_by(CycleResult.result_id)
    question = question.join(DirectionResult).where(DirectionResult.analysis_id == analysis_id)
    return dict(session.execute(question).all())


def _forces() -> Question:
    """One direction of an event's analyses, by plain columns; made once, for that takes longer than asking."""
    direction, analysis = DirectionResult.__table__.c, Analysis.__table__.c
    event, building = Event.__table__.c, Building.__table__.c
    return (
        select(
            direction.id,
            direction.direction,
            event.id.label("event"),
            building.code.label("building"),
            analysis.id.label("analysis"),
            analysis.estimator,
            direction.start,
            direction.rate,
            direction["count"].label("length"),
            direction.peak_displacement,
        )
        .join(Analysis.__table__, analysis.id == direction.analysis_id)
        .join(Event.__table__, event.id == analysis.event_id)
        .join(Building.__table__, building.id == event.building_id)
        .where(event.id == bindparam("event"), direction.direction == bindparam("direction"))
    )


LATEST_FORCE = _forces().where(Analysis.__table__.c.current)
NAMED_FORCE = _forces().where(Analysis.__table__.c.id == bindparam("analysis"))


def restoring_force(session: Session, event_id: int, direction: str, analysis_id: int | None) -> Line:
    """One direction of an event's latest analysis, or of the one that is named, without its histories.

    Raises:
        NotFoundError: there is no such event, analysis or direction.
    """
    wanted = {"event": event_id, "direction": direction}
    if analysis_id is None:
        found = session.execute(LATEST_FORCE, wanted).one_or_none()
    else:
        found = session.execute(NAMED_FORCE, wanted | {"analysis": analysis_id}).one_or_none()
    if found is None:
        raise NotFoundError("result", f"event {event_id}, direction {direction}, analysis {analysis_id or 'latest'}")
    return found


def histories(session: Session, result_id: int, names: Sequence[str]) -> Line:
    """Histories of a direction's result, as stored, in the order of their names."""
    return session.execute(_histories(tuple(names)), {"result": result_id}).one()


@lru_cache(maxsize=256)  # as many as there are choices of the eight
def _histories(names: tuple[str, ...]) -> Question:
    table = DirectionResult.__table__
    return select(*(table.c[name] for name in names)).where(table.c.id == bindparam("result"))


def loop(session: Session, result_id: int) -> Line:
    """Rate, displacement and force of a direction's result, as stored.

    Raises:
        NotFoundError: there is no such result, or nothing measured its displacement.
    """
    question = select(DirectionResult.rate, DirectionResult.displacement, DirectionResult.force)
    usable = question.where(DirectionResult.id == result_id, DirectionResult.displacement.is_not(None))
    found = session.execute(usable).one_or_none()
    if found is None:
        raise NotFoundError("loop of result", result_id)
    return found
