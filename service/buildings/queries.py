"""Reads of the buildings and their sources."""

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.buildings.tables import Building, Revision
from service.db.select import Line, Question
from service.errors import NotFoundError
from service.records.tables import Event, SourceState


def buildings(session: Session) -> Sequence[Line]:
    """(Building, Revision, number of events, start of the last one) by code."""
    events = (
        select(Event.building_id, func.count().label("events"), func.max(Event.start).label("last"))
        .group_by(Event.building_id)
        .subquery()
    )
    query = _latest_revision().add_columns(func.coalesce(events.c.events, 0), events.c.last)
    return session.execute(query.outerjoin(events, events.c.building_id == Building.id).order_by(Building.code)).all()


def building(session: Session, code: str) -> tuple[Building, Revision]:
    """A building and its latest description.

    Raises:
        NotFoundError: there is none by that code.
    """
    row = session.execute(_latest_revision().where(Building.code == code)).one_or_none()
    if row is None:
        raise NotFoundError("building", code)
    return row.Building, row.Revision


def sources(session: Session) -> Sequence[Line]:
    """(Building, Revision, SourceState | None) by code."""
    query = _latest_revision().add_columns(SourceState)
    return session.execute(
        query.outerjoin(SourceState, SourceState.building_id == Building.id).order_by(Building.code)
    ).all()


def _latest_revision() -> Question:
    """Buildings, each with its latest description."""
    newest = (
        select(Revision.building_id, func.max(Revision.number).label("number"))
        .group_by(Revision.building_id)
        .subquery()
    )
    return (
        select(Building, Revision)
        .join(newest, newest.c.building_id == Building.id)
        .join(Revision, (Revision.building_id == Building.id) & (Revision.number == newest.c.number))
    )
