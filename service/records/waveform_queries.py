"""What is asked about what was recorded."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session, joinedload, undefer

from service.buildings.tables import Building
from service.db.select import Line
from service.errors import NotFoundError
from service.records.tables import Event, Waveform


def channel(session: Session, event_id: int, name: str) -> tuple[Event, Sequence[Waveform]]:
    """An event and the pieces of one of its channels with their samples, in order of time.

    Raises:
        NotFoundError: there is no such event, or it has no such channel.
    """
    found = session.scalars(select(Event).options(joinedload(Event.building)).where(Event.id == event_id)).one_or_none()
    if found is None:
        raise NotFoundError("event", event_id)
    question = select(Waveform).options(undefer(Waveform.samples)).where(Waveform.event_id == event_id)
    pieces = session.scalars(question.where(Waveform.channel == name).order_by(Waveform.start)).all()
    if not pieces:
        raise NotFoundError(f"channel in event {event_id}", name)
    return found, pieces


def epochs(session: Session) -> Sequence[tuple[Building, Line]]:
    """Every building's channels, each with its spans of time of unchanged gain and rate, in order of time."""
    channel = (Event.building_id, Waveform.channel)
    kind = (*channel, Waveform.gain, Waveform.rate)
    order = (Waveform.start, Waveform.id)
    of_channel = func.row_number().over(partition_by=channel, order_by=order)
    of_kind = func.row_number().over(partition_by=kind, order_by=order)
    pieces = select(  # of pieces that follow each other unchanged the two numbers differ by the same
        *kind, Waveform.start, Event.end, (of_channel - of_kind).label("run")
    ).join(Waveform.event)
    piece = pieces.subquery().c
    same = (piece.building_id, piece.channel, piece.gain, piece.rate)
    start = func.min(piece.start)
    question = select(*same, start.label("start"), func.max(piece.end).label("end")).group_by(*same, piece.run)
    known = {building.id: building for building in session.scalars(select(Building))}
    rows = session.execute(question.order_by(piece.building_id, piece.channel, start))
    return [(known[row.building_id], row) for row in rows]


def pieces(session: Session, start: datetime, end: datetime) -> Sequence[Line]:
    """(id, channel, start, rate, count) of the waveforms of events that overlap a span of time."""
    columns = (Waveform.id, Waveform.channel, Waveform.start, Waveform.rate, Waveform.count)
    question = select(*columns).join(Event, Event.id == Waveform.event_id)
    return session.execute(question.where(Event.start <= end, Event.end >= start)).all()


def samples(session: Session, numbers: Sequence[int]) -> Sequence[Waveform]:
    """These waveforms with their samples."""
    question = select(Waveform).options(undefer(Waveform.samples)).where(Waveform.id.in_(numbers))
    return session.scalars(question.order_by(Waveform.channel, Waveform.start)).all()
