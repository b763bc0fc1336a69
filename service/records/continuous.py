"""Events cut out of continuous records, across the borders of files."""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.formats.trace import Span, Trace, extent
from service.jobs import queue as job_queue
from service.records import events
from service.records.originals import is_there
from service.records.recordings import traces_of
from service.records.tables import Event, Recording
from service.records.trigger import TriggerSettings, Window, windows
from service.settings import Settings


def trigger_settings(settings: Settings) -> TriggerSettings:
    """The trigger's settings."""
    return TriggerSettings(
        short=settings.trigger.short_window,
        long=settings.trigger.long_window,
        on=settings.trigger.on,
        off=settings.trigger.off,
        channels=settings.trigger.channels,
        floor=settings.trigger.floor,
        before=timedelta(seconds=settings.trigger.before),
        after=timedelta(seconds=settings.trigger.after),
    )


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
    """Cut out the earthquakes that a new recording contains, begins or ends.

    The recordings around it are read again from their bytes, so the trigger needs no state of its own.

    Args:
        session: of the transaction.
        building: whose recording it is.
        described: its description.
        recording: a recording that was read.
        traces: of the recording.
        now: aware time.
        settings: of the trigger.
    """
    trigger = trigger_settings(settings)
    memory = trigger.before + trigger.after + timedelta(seconds=2 * trigger.long)
    around = _around(session, recording, memory)
    pieces = [(near, traces if near.id == recording.id else traces_of(session, near, settings)) for near in around]
    shaking = [trace.segment() for _, traces in pieces for trace in traces if trace.quantity == "acceleration"]
    start, end = _extent(recording)
    longest = timedelta(seconds=settings.event.longest)
    for window in windows(shaking, trigger):
        if window.start <= end and window.end >= start:
            bounded = Window(window.start, min(window.end, window.start + longest))
            _cut(session, building, described, bounded, pieces, now, longest)


def _around(session: Session, recording: Recording, memory: timedelta) -> Sequence[Recording]:
    start, end = _extent(recording)
    near = select(Recording).where(
        Recording.building_id == recording.building_id,
        Recording.kind == "waveforms",
        Recording.state == "read",
        Recording.start <= end + memory,
        Recording.end >= start - memory,
        Recording.content.has(is_there()),
    )
    return session.scalars(near.order_by(Recording.start, Recording.id)).all()


def _cut(
    session: Session,
    building: Building,
    described: BuildingFile,
    window: Window,
    pieces: Sequence[tuple[Recording, Sequence[Trace]]],
    now: datetime,
    longest: timedelta,
) -> None:
    event: Event | None = None
    reached = window.start
    for recording, traces in pieces:
        cuts = [piece for trace in traces if (piece := trace.cut(window.start, window.end)) is not None]
        if not cuts:
            continue
        event = event or events.at(session, building, window.start, window.end, now, longest)
        events.add(session, event, recording, cuts, now)
        reached = max(reached, extent(cuts)[1])
    if event is None or event.state != "gathering":
        return
    if reached >= window.end - timedelta(seconds=1) and events.is_complete(event, described):
        job_queue.enqueue(session, event, {}, now)


def _extent(recording: Recording) -> Span:
    """First and last time of a recording that was read."""
    if recording.start is None or recording.end is None:
        raise ValueError(f"recording {recording.id} was not read")
    return recording.start, recording.end
