"""Reads of events, of their waveforms, and of the files they came in."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime

from sqlalchemy import ColumnElement, func, or_, select, tuple_
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from service.analyses.tables import Analysis
from service.buildings.tables import Building
from service.db.select import Line, Place, Question, Span
from service.errors import NotFoundError
from service.records.tables import REJECTED, Event, RecordedChannel, Recording, Waveform

STATES: Mapping[str, str] = {"refused": "rejected", "stored": "waiting", "read": "read"}
"""The state of a recording as people read it, by that of its row."""


def events(
    session: Session, building_id: int, span: Span, min_pga: float | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """(Event, Analysis | None) of a building, the latest first."""
    query = span.limit(_events().where(Event.building_id == building_id))
    if min_pga is not None:
        query = query.where(Analysis.pga >= min_pga)
    if cursor is not None:
        query = query.where(tuple_(Event.start, Event.id) < tuple_(cursor.time, cursor.id))
    return session.execute(query.order_by(Event.start.desc(), Event.id.desc()).limit(limit)).all()


def last_analysed(session: Session, building_id: int) -> Sequence[Line]:
    """(Event, Analysis) of the building's latest event with a result; nothing before the first."""
    usable = _events().where(Event.building_id == building_id, Analysis.id.is_not(None), Analysis.refusal.is_(None))
    return session.execute(usable.order_by(Event.start.desc(), Event.id.desc()).limit(1)).all()


def event(session: Session, identity: int) -> Event:
    """An event with its building and its channels, without their samples.

    Raises:
        NotFoundError: there is no event of that number.
    """
    query = select(Event).options(joinedload(Event.building), selectinload(Event.waveforms))
    row = session.scalars(query.where(Event.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("event", identity)
    return row


def event_with_analysis(session: Session, identity: int) -> Line:
    """(Event, its latest analysis or None).

    Raises:
        NotFoundError: there is no event of that number.
    """
    row = session.execute(_events().where(Event.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("event", identity)
    return row


def neighbours(session: Session, event: Event) -> tuple[Event | None, Event | None]:
    """The building's events just before and just after this one."""
    of_building = select(Event).where(Event.building_id == event.building_id).limit(1)
    here, there = tuple_(Event.start, Event.id), tuple_(event.start, event.id)
    before = session.scalars(of_building.where(here < there).order_by(Event.start.desc(), Event.id.desc()))
    after = session.scalars(of_building.where(here > there).order_by(Event.start, Event.id))
    return before.one_or_none(), after.one_or_none()


def analyses(session: Session, event_id: int) -> Sequence[Analysis]:
    """Every analysis of an event, the earliest first."""
    return session.scalars(select(Analysis).where(Analysis.event_id == event_id).order_by(Analysis.id)).all()


def _events() -> Question:
    """(Event, its latest analysis or None)."""
    return select(Event, Analysis).outerjoin(Analysis, (Analysis.event_id == Event.id) & Analysis.current)


def channel(session: Session, event_id: int, name: str) -> tuple[Event, Sequence[Waveform]]:
    """An event and the pieces of one of its channels with their samples, in order of time.

    Raises:
        NotFoundError: there is no such event, or it has no such channel.
    """
    row = session.scalars(select(Event).options(joinedload(Event.building)).where(Event.id == event_id)).one_or_none()
    if row is None:
        raise NotFoundError("event", event_id)
    query = select(Waveform).options(undefer(Waveform.samples)).where(Waveform.event_id == event_id)
    pieces = session.scalars(query.where(Waveform.channel == name).order_by(Waveform.start)).all()
    if not pieces:
        raise NotFoundError(f"channel in event {event_id}", name)
    return row, pieces


def recorded_channels(session: Session, patterns: Collection[str]) -> Sequence[Line]:
    """(building_id, channel) of the channels with a waveform whose station matches one of some LIKE patterns."""
    query = select(RecordedChannel.building_id, RecordedChannel.channel).where(_is_named(patterns))
    return session.execute(query.order_by(RecordedChannel.building_id, RecordedChannel.channel)).all()


def stations(session: Session, patterns: Collection[str], start: datetime, end: datetime) -> Sequence[Line]:
    """(building_id, name, latitude, longitude, station, start) of the stations that match one of some LIKE patterns.

    A channel exists from its first sample to its last. A station is returned if one of its channels exists between
    `start` and `end`; its own start is the earliest start of these channels.
    """
    own = (RecordedChannel.building_id, RecordedChannel.station)
    within = (_is_named(patterns), RecordedChannel.start <= end, RecordedChannel.end >= start)
    earliest = select(*own, func.min(RecordedChannel.start).label("start")).where(*within).group_by(*own)
    found = earliest.subquery().c  # grouped before the join: ten times fewer rows are joined and sorted
    query = select(found.building_id, Building.name, Building.latitude, Building.longitude, found.station, found.start)
    query = query.join(Building, Building.id == found.building_id)
    return session.execute(query.order_by(found.station, found.building_id)).all()


def _is_named(patterns: Collection[str]) -> ColumnElement[bool]:
    """The condition that the station of a channel matches one of some LIKE patterns."""
    return or_(*(RecordedChannel.station.like(one, escape="\\") for one in patterns))


def epochs(session: Session, buildings: Collection[int], channels: Collection[str]) -> Sequence[Line]:
    """Spans of time in which the gain and rate of these channels stayed the same, by building, channel and time."""
    kind = (Event.building_id, Waveform.channel, Waveform.gain, Waveform.rate)
    order = (Waveform.start, Waveform.id)
    of_channel = func.row_number().over(partition_by=(Event.building_id, Waveform.channel), order_by=order)
    of_kind = func.row_number().over(partition_by=kind, order_by=order)
    pieces = select(  # the two numbers of pieces that follow each other unchanged differ by the same amount
        *kind, Waveform.start, Event.end, (of_channel - of_kind).label("run")
    ).join(Waveform.event)
    wanted = (Event.building_id.in_(buildings), Waveform.channel.in_(channels))
    piece = pieces.where(*wanted).subquery().c
    same, start = (piece.building_id, piece.channel, piece.gain, piece.rate), func.min(piece.start)
    query = select(*same, start.label("start"), func.max(piece.end).label("end")).group_by(*same, piece.run)
    return session.execute(query.order_by(piece.building_id, piece.channel, start)).all()


def pieces(
    session: Session, buildings: Collection[int], channels: Collection[str], start: datetime, end: datetime
) -> Sequence[Line]:
    """(id, channel, start, rate, count) of these channels' waveforms in events that overlap a span of time."""
    columns = (Waveform.id, Waveform.channel, Waveform.start, Waveform.rate, Waveform.count)
    query = select(*columns).join(Event, Event.id == Waveform.event_id)
    wanted = (Event.building_id.in_(buildings), Waveform.channel.in_(channels))
    return session.execute(query.where(*wanted, Event.start <= end, Event.end >= start)).all()


def samples(session: Session, numbers: Sequence[int]) -> Sequence[Waveform]:
    """These waveforms with their samples."""
    query = select(Waveform).options(undefer(Waveform.samples)).where(Waveform.id.in_(numbers))
    return session.scalars(query.order_by(Waveform.channel, Waveform.start)).all()


def recordings(
    session: Session, building_id: int | None, state: str | None, before: int | None, limit: int
) -> Sequence[Recording]:
    """Files as they came, the latest first.

    Args:
        session: to read with.
        building_id: of one building; None: of all.
        state: one of the values of STATES; None: any.
        before: the number at which the page before ended.
        limit: rows.
    """
    query = select(Recording).options(joinedload(Recording.content), joinedload(Recording.building))
    if building_id is not None:
        query = query.where(Recording.building_id == building_id)
    if state is not None:
        query = query.where(Recording.state == next(row for row, shown in STATES.items() if shown == state))
    if before is not None:
        query = query.where(Recording.id < before)
    return session.scalars(query.order_by(Recording.id.desc()).limit(limit)).all()


def rejected_counts(session: Session, buildings: Collection[int]) -> Mapping[int, int]:
    """Number of rejected files by building; buildings without any are omitted."""
    query = select(Recording.building_id, func.count()).where(REJECTED, Recording.building_id.in_(buildings))
    return {line[0]: line[1] for line in session.execute(query.group_by(Recording.building_id))}
