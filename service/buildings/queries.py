"""Reads of the buildings and their sources."""

from collections.abc import Collection, Sequence
from typing import Any

from sqlalchemy import ScalarSelect, func, select
from sqlalchemy.orm import Session, aliased

from service.buildings.tables import Building, Revision
from service.db.select import Line, Question
from service.errors import NotFoundError
from service.records.tables import Event, SourceState


def buildings(session: Session, after: str | None, limit: int) -> Sequence[Line]:
    """(Building, Revision, number of events, start of the last one) by code; the events of this page alone are counted.

    Args:
        session: to read with.
        after: code at which the page before ended.
        limit: rows.
    """
    events = select(func.count()).where(Event.building_id == Building.id).scalar_subquery()
    question = _page(latest_revision().add_columns(events.label("events"), _last_start().label("last")), after, limit)
    return session.execute(question).all()


def building(session: Session, code: str) -> tuple[Building, Revision]:
    """A building and its latest description.

    Raises:
        NotFoundError: there is none by that code.
    """
    row = session.execute(latest_revision().where(Building.code == code)).one_or_none()
    if row is None:
        raise NotFoundError("building", code)
    return row.Building, row.Revision


def by_number(session: Session, numbers: Collection[int]) -> Sequence[Line]:
    """(Building, Revision) of the buildings of these numbers."""
    return session.execute(latest_revision().where(Building.id.in_(numbers))).all()


def sources(session: Session, after: str | None, limit: int) -> Sequence[Line]:
    """(Building, Revision, SourceState | None) by code.

    Args:
        session: to read with.
        after: code at which the page before ended.
        limit: rows.
    """
    question = latest_revision().add_columns(SourceState)
    joined = question.outerjoin(SourceState, SourceState.building_id == Building.id)
    return session.execute(_page(joined, after, limit)).all()


def failing_states(session: Session, numbers: Collection[int]) -> Sequence[SourceState]:
    """The sources that fail, of the buildings of these numbers."""
    failing = (SourceState.building_id.in_(numbers), SourceState.failing_since.is_not(None))
    return session.scalars(select(SourceState).where(*failing)).all()


def _page(question: Question, after: str | None, limit: int) -> Question:
    following = question if after is None else question.where(Building.code > after)
    return following.order_by(Building.code).limit(limit)


def _last_start() -> ScalarSelect[Any]:
    """Start of the last event of a building of the question around it."""
    return select(func.max(Event.start)).where(Event.building_id == Building.id).scalar_subquery()


def latest_revision() -> Question:
    """Buildings, each with its latest description."""
    other = aliased(Revision)
    newest = select(func.max(other.number)).where(other.building_id == Building.id).scalar_subquery()
    question = select(Building, Revision).select_from(Building)
    return question.join(Revision, (Revision.building_id == Building.id) & (Revision.number == newest))
