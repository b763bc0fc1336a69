"""What is asked of the database about the isolation layer across an event's directions, by name."""

from sqlalchemy import select
from sqlalchemy.orm import Session, aliased

from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.buildings.tables import Building
from service.db.select import Line, Question
from service.errors import NotFoundError
from service.records.tables import Event


def layer_result(session: Session, analysis_id: int) -> LayerResult | None:
    """What an analysis found across its directions, without histories; None where it is nothing."""
    return session.scalars(select(LayerResult).where(LayerResult.analysis_id == analysis_id)).one_or_none()


def layer_motion(session: Session, event_id: int, analysis_id: int | None) -> Line:
    """Histories across the directions of an event's latest analysis, or of the one that is named, as stored.

    Raises:
        NotFoundError: there is no such event or analysis, or it found nothing across its directions.
    """
    wanted = Analysis.current if analysis_id is None else Analysis.id == analysis_id
    found = session.execute(_motions().where(Event.id == event_id, wanted)).one_or_none()
    if found is None:
        raise NotFoundError("layer motion", f"event {event_id}, analysis {analysis_id or 'latest'}")
    return found


def of_result(session: Session, layer_id: int) -> Line:
    """The same by the layer result's own number.

    Raises:
        NotFoundError: there is no such result.
    """
    found = session.execute(_motions().where(LayerResult.id == layer_id)).one_or_none()
    if found is None:
        raise NotFoundError("layer result", layer_id)
    return found


def _motions() -> Question:
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
