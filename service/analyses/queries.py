"""Reads of the results of one analysis: directions, histories, and the isolation layer across directions."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TypeVar

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session, aliased, selectinload

from service.analyses.tables import DELETED, Analysis, CycleResult, DirectionResult, LayerResult, ShakingResult
from service.buildings.tables import Building
from service.db.select import Line, Question
from service.errors import NotFoundError
from service.records.tables import Event

PRUNED_BY = "retention.superseded_analyses"
"""Setting by which an analysis may have gone that a later one superseded."""
Result = TypeVar("Result", DirectionResult, LayerResult, ShakingResult)


def direction_results(session: Session, analysis_id: int) -> Sequence[DirectionResult]:
    """Results of an analysis by direction, with modes, without histories."""
    query = select(DirectionResult).options(selectinload(DirectionResult.modes))
    return session.scalars(
        query.where(DirectionResult.analysis_id == analysis_id).order_by(DirectionResult.direction)
    ).all()


def peaks(session: Session, analyses: Sequence[int]) -> Mapping[tuple[int, str], tuple[float | None, float]]:
    """Largest displacement (m, None where it was not measured) and restoring force (N), by analysis and direction."""
    columns = (
        DirectionResult.analysis_id,
        DirectionResult.direction,
        DirectionResult.peak_displacement,
        DirectionResult.peak_force,
    )
    rows = session.execute(select(*columns).where(DirectionResult.analysis_id.in_(analyses)))
    return {(analysis, direction): (displacement, force) for analysis, direction, displacement, force in rows}


def cycle_counts(session: Session, analysis_id: int) -> Mapping[int, int]:
    """Number of cycles of an analysis by direction result; results without cycles are missing."""
    query = select(CycleResult.result_id, func.count()).group_by(CycleResult.result_id)
    query = query.join(DirectionResult).where(DirectionResult.analysis_id == analysis_id)
    return dict(session.execute(query).all())


def _forces() -> Question:
    """One direction of an event's analyses, by plain columns; built once, as that takes longer than running it."""
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
            func.length(direction.force).label("stored"),
        )
        .join(Analysis.__table__, analysis.id == direction.analysis_id)
        .join(Event.__table__, event.id == analysis.event_id)
        .join(Building.__table__, building.id == event.building_id)
        .where(event.id == bindparam("event"), direction.direction == bindparam("direction"))
    )


LATEST_FORCE = _forces().where(Analysis.__table__.c.current)
NAMED_FORCE = _forces().where(Analysis.__table__.c.id == bindparam("analysis"))


def restoring_force(session: Session, event_id: int, direction: str, analysis_id: int | None) -> Line:
    """One direction of an event's latest analysis, or of the named one, without its histories.

    Raises:
        NotFoundError: there is no such event, analysis or direction.
    """
    wanted = {"event": event_id, "direction": direction}
    if analysis_id is None:
        row = session.execute(LATEST_FORCE, wanted).one_or_none()
    else:
        row = session.execute(NAMED_FORCE, wanted | {"analysis": analysis_id}).one_or_none()
    if row is None:
        name = f"event {event_id}, direction {direction}, analysis {analysis_id or 'latest'}"
        raise NotFoundError("result", name, None if analysis_id is None else PRUNED_BY)
    if row.stored <= len(DELETED):
        raise NotFoundError("history any more", f"analysis {row.analysis}, which a later one superseded")
    return row


def histories(session: Session, result_id: int, names: Sequence[str]) -> Line:
    """Histories of a direction's result, as stored, in the order of their names."""
    return session.execute(_histories(tuple(names)), {"result": result_id}).one()


@lru_cache(maxsize=256)  # as many as there are choices of the eight
def _histories(names: tuple[str, ...]) -> Question:
    table = DirectionResult.__table__
    return select(*(table.c[name] for name in names)).where(table.c.id == bindparam("result"))


def loop(session: Session, result_id: int) -> Line:
    """Rate, displacement, force and the force's standard deviation of a direction's result, as stored.

    Raises:
        NotFoundError: there is no such result, or nothing measured its displacement.
    """
    table = DirectionResult
    query = select(table.rate, table.displacement, table.force, table.force_std_history)
    usable = query.where(table.id == result_id, table.displacement.is_not(None))
    row = session.execute(usable).one_or_none()
    if row is None:
        raise NotFoundError("loop of result", result_id)
    return row


def direction_of(session: Session, result_id: int) -> Line:
    """Event, its start, and analysis, direction, time of the first sample (`begun`) and rate (Hz) of a result.

    Raises:
        NotFoundError: there is no such result.
    """
    own = (DirectionResult.analysis_id, DirectionResult.direction, DirectionResult.start.label("begun"))
    columns = (Analysis.event_id.label("event"), Event.start, *own, DirectionResult.rate)
    query = select(*columns).select_from(DirectionResult).join(Analysis, Analysis.id == DirectionResult.analysis_id)
    query = query.join(Event, Event.id == Analysis.event_id).where(DirectionResult.id == result_id)
    row = session.execute(query).one_or_none()
    if row is None:
        raise NotFoundError("result", result_id)
    return row


def layer_result(session: Session, analysis_id: int) -> LayerResult | None:
    """The result of an analysis across its directions, without histories; None where there is none."""
    return session.scalars(select(LayerResult).where(LayerResult.analysis_id == analysis_id)).one_or_none()


def shaking_result(session: Session, analysis_id: int) -> ShakingResult | None:
    """Strength of the shaking by an analysis; None where an earlier version made it."""
    return session.scalars(select(ShakingResult).where(ShakingResult.analysis_id == analysis_id)).one_or_none()


def by_analysis(session: Session, table: type[Result], analyses: Sequence[int]) -> Mapping[int, list[Result]]:
    """Results of one kind, without histories, by analysis."""
    rows: dict[int, list[Result]] = defaultdict(list)
    for one in session.scalars(select(table).where(table.analysis_id.in_(analyses))):
        rows[one.analysis_id].append(one)
    return rows


def layer_motion(session: Session, event_id: int, analysis_id: int | None) -> Line:
    """Histories across the directions of an event's latest analysis, or of the named one, as stored.

    Raises:
        NotFoundError: there is no such event or analysis, or it has no result across its directions.
    """
    wanted = Analysis.current if analysis_id is None else Analysis.id == analysis_id
    row = session.execute(_layer_motions().where(Event.id == event_id, wanted)).one_or_none()
    if row is None:
        name = f"event {event_id}, analysis {analysis_id or 'latest'}"
        raise NotFoundError("layer motion", name, None if analysis_id is None else PRUNED_BY)
    return row


def layer_motion_of(session: Session, layer_id: int) -> Line:
    """The same histories, by the number of the layer result.

    Raises:
        NotFoundError: there is no such result.
    """
    row = session.execute(_layer_motions().where(LayerResult.id == layer_id)).one_or_none()
    if row is None:
        raise NotFoundError("layer result", layer_id)
    return row


def _layer_motions() -> Question:
    x, y = aliased(DirectionResult), aliased(DirectionResult)
    return (
        select(
            LayerResult.id,
            Event.id.label("event"),
            Building.code.label("building"),
            Analysis.id.label("analysis"),
            LayerResult.start,
            LayerResult.rate,
            LayerResult.count.label("length"),
            LayerResult.axial_load_level,
            x.displacement.label("displacement_x"),
            y.displacement.label("displacement_y"),
            LayerResult.torsion,
            LayerResult.torsion_std_history.label("torsion_std"),
            LayerResult.axial_load,
        )
        .join(Analysis, Analysis.id == LayerResult.analysis_id)
        .join(Event, Event.id == Analysis.event_id)
        .join(Building, Building.id == Event.building_id)
        .outerjoin(x, (x.analysis_id == Analysis.id) & (x.direction == "x"))
        .outerjoin(y, (y.analysis_id == Analysis.id) & (y.direction == "y"))
    )
