"""Events: records of one earthquake joined together, and queued for analysis when they are complete."""

import logging
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from datetime import datetime, timedelta

import numpy as np
from sqlalchemy import ColumnElement, or_, select, update
from sqlalchemy.orm import Session, undefer

from service import logs
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.db.blobs import decode, encode
from service.db.process_leases import is_wrong
from service.db.upsert import insert_into
from service.formats.trace import Trace, extent, overlapping
from service.jobs import queue as job_queue
from service.jobs.tables import Job
from service.records.tables import Event, EventRecording, RecordedChannel, Recording, Waveform
from service.settings import Settings

log = logging.getLogger(__name__)


def take_in(
    session: Session,
    building: Building,
    described: BuildingFile,
    recording: Recording,
    traces: Sequence[Trace],
    now: datetime,
    *,
    settings: Settings,
) -> None:
    """Join the traces of a recording to their events, and queue the events that are complete."""
    tolerance = timedelta(seconds=settings.event.tolerance)
    for group in overlapping(traces, lambda trace: trace.span, tolerance):
        start, end = extent(group)
        longest = timedelta(seconds=settings.event.longest) + 2 * tolerance
        had = _joined(session, building, start - tolerance, end + tolerance, longest)
        event = had or _begun(session, building, start, end, now)
        add(session, event, recording, group, now)
        if event.state != "gathering" or not is_complete(event, described):
            continue
        if had is None:
            job_queue.enqueue_first(session, event, now)
        else:
            job_queue.enqueue(session, event, {}, now)


def queue_ready(session: Session, now: datetime, *, settings: Settings) -> int:
    """Queue the events that have waited long enough for missing channels.

    Returns:
        The number of them.
    """
    waiting = select(Event).where(Event.state == "gathering", _has_waited(now, settings))
    ready = list(session.scalars(waiting.order_by(Event.start).with_for_update(skip_locked=True)))
    for event in ready:
        job_queue.enqueue(session, event, {}, now)
    return len(ready)


def is_any_ready(session: Session, now: datetime, *, settings: Settings) -> bool:
    """True if `queue_ready` would queue an event; it reads only."""
    return (
        session.scalar(select(Event.id).where(Event.state == "gathering", _has_waited(now, settings)).limit(1))
        is not None
    )


def _has_waited(now: datetime, settings: Settings) -> ColumnElement[bool]:
    """The condition that an event has waited long enough for missing channels."""
    patience, came = timedelta(seconds=settings.event.grace), Event.updated_at
    return or_(came <= now - patience, is_wrong(came, now - patience, patience))


def queue_now(session: Session, building: Building, now: datetime) -> None:
    """Queue the building's events as they are: no further files will come."""
    waiting = select(Event).where(Event.building_id == building.id, Event.state == "gathering")
    for event in session.scalars(waiting.with_for_update(skip_locked=True)):
        job_queue.enqueue(session, event, {}, now)


def add(session: Session, event: Event, recording: Recording, traces: Sequence[Trace], now: datetime) -> None:
    """Add a recording's traces to an event, without samples that the event already has."""
    link = {"event_id": event.id, "recording_id": recording.id}
    session.execute(insert_into(session, EventRecording).on_conflict_do_nothing(), [link])
    pieces = _pieces(session, event, {trace.channel for trace in traces})
    added = [_add(session, event, trace, pieces[trace.channel]) for trace in traces]
    if any(added):
        remember_channels(session, event.building_id, [piece for one in pieces.values() for piece in one])
        event.start = min(waveform.start for waveform in event.waveforms)
        event.end = max(_end(waveform) for waveform in event.waveforms)
        event.state, event.reason, event.updated_at = "gathering", None, now
        event.recorded_peak = max((event.recorded_peak, *map(_peak, traces)), key=lambda one: one or 0.0)


def remember_channels(session: Session, building_id: int, pieces: Iterable[Waveform]) -> None:
    """Extend the recorded span of each channel by these pieces."""
    columns = (RecordedChannel.channel, RecordedChannel.start, RecordedChannel.end)
    rows_there = session.execute(select(*columns).where(RecordedChannel.building_id == building_id))
    noted = {row.channel: (row.start, row.end) for row in rows_there}
    spans = dict(noted)
    for piece in pieces:
        start, end = spans.get(piece.channel, (piece.start, piece.start))
        spans[piece.channel] = min(start, piece.start), max(end, _end(piece))
    rows = [
        {
            "building_id": building_id,
            "channel": one,
            "station": ".".join(one.split(".")[:2]),
            "start": start,
            "end": end,
        }
        for one, (start, end) in sorted(spans.items())
        if noted.get(one) != (start, end)
    ]
    if rows:
        insert = insert_into(session, RecordedChannel).values(rows)
        changed = {"start": insert.excluded.start, "end": insert.excluded.end}
        session.execute(insert.on_conflict_do_update(index_elements=["building_id", "channel"], set_=changed))


def is_complete(event: Event, described: BuildingFile) -> bool:
    """True if the event has samples of every channel of the building."""
    there = {waveform.channel for waveform in event.waveforms}
    return all(channel.id in there for channel in described.description.channels)


def at(
    session: Session, building: Building, start: datetime, end: datetime, now: datetime, longest: timedelta
) -> Event:
    """The building's event between two times: a new one, or the existing ones merged if they were never queued.

    An event that would become longer than `longest` stays as it is.
    """
    return _joined(session, building, start, end, longest) or _begun(session, building, start, end, now)


def _joined(session: Session, building: Building, start: datetime, end: datetime, longest: timedelta) -> Event | None:
    """The existing events between two times, merged as `at` says; None if there are none."""
    ready = list(
        session.scalars(
            select(Event)
            .where(Event.building_id == building.id, Event.start <= end, Event.end >= start)
            .order_by(Event.start, Event.id)
        )
    )
    joined: list[Event] = []
    for one in ready:
        first, last = min(start, one.start), max(end, one.end)
        if last - first <= longest and (not joined or not _ever_queued(session, one)):
            joined.append(one)
            start, end = first, last
    if not joined:
        return None
    into, *others = joined
    for other in others:
        _merge(session, other, into=into)
    return into


def _begun(session: Session, building: Building, start: datetime, end: datetime, now: datetime) -> Event:
    """A new event, without waveforms."""
    times = {"start": start, "end": end, "created_at": now, "updated_at": now}
    event = Event(building_id=building.id, state="gathering", waveforms=[], **times)
    session.add(event)
    session.flush()
    with logs.about(event=event.id, building=building.code):
        log.info("event %d of %s: an earthquake begins to arrive", event.id, building.code)
    return event


def _peak(trace: Trace) -> float | None:
    """m/s², largest deviation of an accelerometer from its mean."""
    if trace.quantity != "acceleration" or not trace.numbers.size:
        return None
    numbers = trace.numbers.astype(np.float64)
    return float(abs(trace.gain) * np.abs(numbers - numbers.mean()).max())


def _ever_queued(session: Session, event: Event) -> bool:
    return session.scalar(select(Job.id).where(Job.event_id == event.id).limit(1)) is not None


def _merge(session: Session, event: Event, *, into: Event) -> None:
    """Merge two events after a file has closed the gap between them: they are one earthquake."""
    session.flush()
    session.execute(update(Waveform).where(Waveform.event_id == event.id).values(event_id=into.id))
    for one in (event, into):
        session.expire(one, ["waveforms"])
    for link in session.scalars(select(EventRecording).where(EventRecording.event_id == event.id)):
        if session.get(EventRecording, (into.id, link.recording_id)) is None:
            session.add(EventRecording(event_id=into.id, recording_id=link.recording_id))
        session.delete(link)
    into.recorded_peak = max(into.recorded_peak, event.recorded_peak, key=lambda one: one or 0.0)
    session.flush()
    session.delete(event)
    session.flush()


def _pieces(session: Session, event: Event, channels: Collection[str]) -> defaultdict[str, list[Waveform]]:
    """The event's pieces of these channels, with their samples, by channel; one query for all, if there are any."""
    pieces = defaultdict[str, list[Waveform]](list)
    if not any(one.channel in channels for one in event.waveforms):
        return pieces
    of_event = select(Waveform).where(Waveform.event_id == event.id, Waveform.channel.in_(sorted(channels)))
    for one in session.scalars(of_event.options(undefer(Waveform.samples)).order_by(Waveform.id)):
        pieces[one.channel].append(one)
    return pieces


def _add(session: Session, event: Event, trace: Trace, pieces: list[Waveform]) -> bool:
    """Store the samples that the event does not have yet; False if there are none.

    Args:
        session: to write with.
        event: that the trace belongs to.
        trace: of one channel.
        pieces: of the channel, which the event has; what is stored here joins them.
    """
    new: Trace | None = trace
    for had in tuple(pieces):
        new = None if new is None else _unknown_part(new, had)
        if new is not None and new.start == had.start:  # the same piece, longer now: its file was still growing
            event.waveforms.remove(had)
            session.delete(had)
            session.flush()
            pieces.remove(had)
    if new is None:
        return False
    stored = Waveform(
        channel=new.channel,
        start=new.start,
        rate=new.rate,
        count=new.numbers.size,
        gain=new.gain,
        samples=encode(new.numbers),
    )
    event.waveforms.append(stored)
    pieces.append(stored)
    return True


def _unknown_part(trace: Trace, had: Waveform) -> Trace | None:
    """The part of a trace beyond a stored piece: all of it unless the two agree where they overlap."""
    start, end = had.start, _end(had)
    if had.rate != trace.rate or had.gain != trace.gain or end < trace.start or trace.span[1] < start:
        return trace
    shared = trace.cut(start, end)
    offset = round((max(trace.start, start) - start).total_seconds() * had.rate)
    if shared is None or not _equal(decode(had.samples)[offset : offset + shared.numbers.size], shared):
        return trace
    if start > trace.start:
        return trace
    return trace.cut(end + timedelta(seconds=0.5 / trace.rate), trace.span[1])


def _equal(stored: object, shared: Trace) -> bool:
    return bool((stored == shared.numbers).all()) if getattr(stored, "size", -1) == shared.numbers.size else False


def _end(waveform: Waveform) -> datetime:
    return waveform.start + timedelta(seconds=(waveform.count - 1) / waveform.rate)
