"""What is asked about the drift of a building's series, as it was monitored last."""

from collections.abc import Mapping, Sequence

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session, joinedload

from service.db.select import Line, Place, Question, Span
from service.drift.tables import DriftAlarm, DriftValue, WatchedSeries
from service.errors import NotFoundError
from service.records.tables import Event


def every_series(session: Session, building_id: int) -> Sequence[WatchedSeries]:
    """All that is watched at a building, by quantity and subject."""
    question = select(WatchedSeries).where(WatchedSeries.building_id == building_id)
    return session.scalars(question.order_by(WatchedSeries.quantity, WatchedSeries.subject)).all()


def one_series(session: Session, building_id: int, quantity: str, subject: str) -> WatchedSeries:
    """A series of a building.

    Raises:
        NotFoundError: nothing of that name was monitored there.
    """
    named = (WatchedSeries.quantity == quantity, WatchedSeries.subject == subject)
    found = session.scalars(select(WatchedSeries).where(WatchedSeries.building_id == building_id, *named)).one_or_none()
    if found is None:
        raise NotFoundError("watched series", f"{quantity}/{subject}")
    return found


def values(
    session: Session,
    building_id: int,
    span: Span,
    quantity: str | None,
    subject: str | None,
    cursor: Place | None,
    limit: int,
) -> Sequence[Line]:
    """Every event's value in these series, the earliest event first; the last column is the value's id."""
    of_value = ("value", "std", "count", "is_reference", "is_beyond", "is_excluded", "causes")
    question: Question = (
        select(
            Event.id.label("event"),
            Event.start.label("event_start"),
            WatchedSeries.quantity,
            WatchedSeries.subject,
            *(DriftValue.__table__.c[name] for name in of_value),
            DriftValue.id,
        )
        .join(DriftValue, DriftValue.event_id == Event.id)
        .join(WatchedSeries, WatchedSeries.id == DriftValue.series_id)
        .where(WatchedSeries.building_id == building_id)
    )
    for column, wanted in ((WatchedSeries.quantity, quantity), (WatchedSeries.subject, subject)):
        if wanted is not None:
            question = question.where(column == wanted)
    if cursor is not None:
        question = question.where(tuple_(Event.start, DriftValue.id) > tuple_(cursor.time, cursor.id))
    return session.execute(span.limit(question).order_by(Event.start, DriftValue.id).limit(limit)).all()


def counts(session: Session, building_id: int) -> Mapping[int, int]:
    """Number of values by series; those without any are not in it."""
    question = select(DriftValue.series_id, func.count()).group_by(DriftValue.series_id)
    question = question.join(WatchedSeries).where(WatchedSeries.building_id == building_id)
    return dict(session.execute(question).all())


def latest_values(session: Session, building_id: int) -> Mapping[int, DriftValue]:
    """The value of the latest event of each series, by series."""
    question = select(DriftValue).join(WatchedSeries).join(Event, Event.id == DriftValue.event_id)
    found = session.scalars(question.where(WatchedSeries.building_id == building_id).order_by(Event.start, Event.id))
    return {value.series_id: value for value in found}


def alarms(session: Session, building_id: int) -> Sequence[DriftAlarm]:
    """What the rules found, by quantity and subject, in the order in which it was raised; with series and events."""
    question = select(DriftAlarm).join(DriftAlarm.series).where(WatchedSeries.building_id == building_id)
    loaded = question.options(
        *(
            joinedload(one)
            for one in (DriftAlarm.series, DriftAlarm.onset, DriftAlarm.after, DriftAlarm.by, DriftAlarm.raised)
        )
    )
    return session.scalars(loaded.order_by(WatchedSeries.quantity, WatchedSeries.subject, DriftAlarm.id)).all()
