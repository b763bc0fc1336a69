"""Queries of models' versions and comparisons."""

from collections.abc import Collection, Mapping, Sequence

from sqlalchemy import ColumnElement, Select, exists, func, select, tuple_
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from service.analyses.tables import Analysis, DirectionResult
from service.buildings.tables import Building
from service.db.select import Line, Place
from service.errors import NotFoundError
from service.models.choice import Moved
from service.models.tables import DiagnosisPicture, ModelComparison, ModelDiagnosis, ModelVersion
from service.records.tables import Event

DIRECTIONS: Mapping[str, tuple[str, ...]] = {"x": ("x",), "y": ("y",), "xy": ("x", "y")}
"""Horizontal directions in which a model of such a direction holds."""


def versions(
    session: Session, building_id: int, direction: str | None, state: str | None, before: int | None, limit: int
) -> Sequence[ModelVersion]:
    """Versions of a building's models, the latest first; `before` is the id at which the page before ended."""
    query = select(ModelVersion).where(ModelVersion.building_id == building_id)
    for column, wanted in ((ModelVersion.direction, direction), (ModelVersion.state, state)):
        if wanted is not None:
            query = query.where(column == wanted)
    if before is not None:
        query = query.where(ModelVersion.id < before)
    return session.scalars(query.order_by(ModelVersion.id.desc()).limit(limit)).all()


def version(session: Session, identity: int) -> ModelVersion:
    """A version with its building.

    Raises:
        NotFoundError: there is none by that number.
    """
    query = select(ModelVersion).options(joinedload(ModelVersion.building))
    row = session.scalars(query.where(ModelVersion.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("model", identity)
    return row


def lineage(session: Session, identity: int) -> Sequence[ModelVersion]:
    """A version and all that it came from, the first one first."""
    ancestors = select(ModelVersion.id, ModelVersion.parent_id).where(ModelVersion.id == identity).cte(recursive=True)
    parents = select(ModelVersion.id, ModelVersion.parent_id).join(ancestors, ModelVersion.id == ancestors.c.parent_id)
    line = ancestors.union_all(parents)
    query = select(ModelVersion).join(line, line.c.id == ModelVersion.id)
    return session.scalars(query.order_by(ModelVersion.id)).all()


def current_versions(session: Session, building_id: int) -> Sequence[ModelVersion]:
    """The current versions, one of a direction at most."""
    query = select(ModelVersion).where(ModelVersion.building_id == building_id, ModelVersion.state == "current")
    return session.scalars(query.order_by(ModelVersion.direction)).all()


def former_version(session: Session, current: ModelVersion) -> ModelVersion | None:
    """The version that was current before; None if there was none."""
    of_line = (ModelVersion.building_id == current.building_id, ModelVersion.direction == current.direction)
    query = select(ModelVersion).where(*of_line, ModelVersion.state == "retired")
    return session.scalars(query.order_by(ModelVersion.accepted_at.desc()).limit(1)).one_or_none()


def comparisons(
    session: Session, model_id: int, cursor: Place | None, limit: int
) -> Sequence[tuple[ModelComparison, Event]]:
    """A version's comparisons and their events, the earliest first."""
    query = select(ModelComparison, Event).join(ModelComparison.event).where(ModelComparison.model_id == model_id)
    if cursor is not None:
        query = query.where(tuple_(Event.start, ModelComparison.id) > tuple_(cursor.time, cursor.id))
    rows = session.execute(query.order_by(Event.start, ModelComparison.id).limit(limit))
    return [(comparison, event) for comparison, event in rows]


def comparison(session: Session, identity: int) -> ModelComparison:
    """A comparison with its model's force.

    Raises:
        NotFoundError: there is none by that number.
    """
    query = select(ModelComparison).options(joinedload(ModelComparison.event), undefer(ModelComparison.force))
    row = session.scalars(query.where(ModelComparison.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("comparison", identity)
    return row


def latest_comparisons(
    session: Session, model_ids: Collection[int]
) -> Mapping[int, Sequence[tuple[ModelComparison, Event]]]:
    """By version: its last comparison with each event in each direction, the earliest event first."""
    query = select(ModelComparison, Event).join(ModelComparison.event)
    rows = session.execute(query.where(ModelComparison.model_id.in_(model_ids)).order_by(ModelComparison.id))
    last = {(one.model_id, one.event_id, one.direction): (one, event) for one, event in rows}
    ordered = sorted(last.values(), key=lambda pair: (pair[1].start, pair[0].id))
    return {model: [pair for pair in ordered if pair[0].model_id == model] for model in model_ids}


def measured(session: Session, analysis_id: int, direction: str) -> Line:
    """Start, rate, displacement and force of an analysis in a direction, as stored."""
    columns = ("start", "rate", "displacement", "force")
    query = select(*(DirectionResult.__table__.c[name] for name in columns))
    of_analysis = (DirectionResult.analysis_id == analysis_id, DirectionResult.direction == direction)
    return session.execute(query.where(*of_analysis)).one()


def comparable(
    session: Session, building_id: int, directions: Collection[str], among: Collection[int] | None
) -> Sequence[Event]:
    """Events whose latest analysis has the layer's motion in one of these directions, the earliest first.

    Of those of the numbers in `among`, or of all where that is None.
    """
    query = _analysed(building_id).where(_has_motion(directions))
    if among is not None:
        query = query.where(Event.id.in_(among))
    return session.scalars(query.order_by(Event.start, Event.id)).all()


def latest_comparable(session: Session, building_id: int, directions: Collection[str], limit: int) -> Sequence[Event]:
    """The latest so many events of `comparable`, the latest first."""
    query = _analysed(building_id).where(_has_motion(directions))
    return session.scalars(query.order_by(Event.start.desc(), Event.id.desc()).limit(limit)).all()


def shakes(session: Session, building_id: int, limit: int) -> Sequence[Line]:
    """Event, ground acceleration and building of the earthquakes whose ground was recorded, the building's own first,
    then the strongest first."""
    query = (
        select(Event, Analysis.pga, Building)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
        .join(Building, Building.id == Event.building_id)
        .where(Analysis.pga.is_not(None))
        .order_by(Event.building_id != building_id, Analysis.pga.desc(), Event.id)
    )
    return session.execute(query.limit(limit)).all()


def moved(session: Session, building_id: int, directions: Collection[str]) -> list[Moved]:
    """The events of `comparable`, each with its largest displacement in these directions."""
    largest = func.max(DirectionResult.peak_displacement)
    query = (
        select(Event.id, Event.start, largest)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id, DirectionResult.direction.in_(directions))
        .where(DirectionResult.displacement.is_not(None))
        .group_by(Event.id, Event.start)
        .order_by(Event.start, Event.id)
    )
    return [Moved(event, start, displacement or 0.0) for event, start, displacement in session.execute(query)]


def of_event(session: Session, model_id: int, event_id: int) -> Sequence[ModelComparison]:
    """The latest comparisons of a version with an event, one of each direction."""
    query = select(ModelComparison).where(ModelComparison.model_id == model_id, ModelComparison.event_id == event_id)
    last = {one.direction: one for one in session.scalars(query.order_by(ModelComparison.id))}
    return [last[direction] for direction in sorted(last)]


def current_forces(
    session: Session, analysis_id: int, direction: str
) -> Sequence[tuple[ModelVersion, ModelComparison]]:
    """The current versions that were compared with an analysis in a direction, with their forces."""
    query = select(ModelVersion, ModelComparison).join(ModelComparison.model).options(undefer(ModelComparison.force))
    of_analysis = (ModelComparison.analysis_id == analysis_id, ModelComparison.direction == direction)
    rows = session.execute(query.where(*of_analysis, ModelVersion.state == "current").order_by(ModelVersion.direction))
    return [(version, compared) for version, compared in rows]


def not_comparable(session: Session, building_id: int, directions: Collection[str]) -> Sequence[Event]:
    """Events that were analysed, but for refused or without the layer's motion in these directions; earliest first."""
    query = _analysed(building_id).where(~_has_motion(directions))
    return session.scalars(query.order_by(Event.start, Event.id)).all()


def _analysed(building_id: int) -> Select[Event]:
    latest = (Analysis.event_id == Event.id) & Analysis.current
    return select(Event).join(Analysis, latest).where(Event.building_id == building_id)


def _has_motion(directions: Collection[str]) -> ColumnElement[bool]:
    of_analysis = (DirectionResult.analysis_id == Analysis.id, DirectionResult.direction.in_(directions))
    return exists().where(*of_analysis, DirectionResult.displacement.is_not(None))


def diagnoses(session: Session, model_id: int, before: int | None, limit: int) -> Sequence[ModelDiagnosis]:
    """Diagnoses of a version, the latest first; `before` is the id at which the page before ended."""
    query = select(ModelDiagnosis).where(ModelDiagnosis.model_id == model_id)
    if before is not None:
        query = query.where(ModelDiagnosis.id < before)
    return session.scalars(query.order_by(ModelDiagnosis.id.desc()).limit(limit)).all()


def diagnosis(session: Session, identity: int) -> ModelDiagnosis:
    """A diagnosis with its model, its document and the titles of its pictures.

    Raises:
        NotFoundError: there is none by that number.
    """
    query = select(ModelDiagnosis).options(
        undefer(ModelDiagnosis.document),
        selectinload(ModelDiagnosis.pictures),
        joinedload(ModelDiagnosis.model).joinedload(ModelVersion.building),
    )
    row = session.scalars(query.where(ModelDiagnosis.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("diagnosis", identity)
    return row


def picture(session: Session, identity: int) -> DiagnosisPicture:
    """A chart of a diagnosis.

    Raises:
        NotFoundError: there is none by that number.
    """
    query = select(DiagnosisPicture).options(undefer(DiagnosisPicture.svg), undefer(DiagnosisPicture.spec))
    row = session.scalars(query.where(DiagnosisPicture.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("picture", identity)
    return row
