"""The one way in for files, from the poller, the import command or a test: bytes first, then what they hold."""

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session

from service import buildings, continuous, events, formats
from service.building_file import BuildingFile
from service.contents import data_of, gains
from service.database import Building, Recording
from service.formats import Contents, FormatError, Trace, UnknownUnitError
from service.recordings import store
from service.settings import Settings
from service.spans import span

CLOCK_SET = datetime(1980, 1, 1, tzinfo=UTC)
"""No strong-motion logger with a clock is older: earlier times are those of a clock that was never set."""
CLOCK_SLACK = timedelta(days=1)


def ingest(
    session: Session, building: Building, name: str, origin: str, data: bytes, now: datetime, *, settings: Settings
) -> Recording:
    """Keep a file, read it, and join its records to their events, in one transaction.

    Where a crash must not lose the bytes, commit between `recordings.store` and `read_stored`.
    """
    recording = store(session, building, name, origin, data, now)
    read_stored(session, building, now, settings=settings)
    return recording


def read_stored(session: Session, building: Building, now: datetime, *, settings: Settings) -> int:
    """Read every recording of the building that is stored and not read yet; the number of those read.

    Station files come first, and after them those that were refused for want of one.
    """
    count = 0
    while (recording := _next_stored(session, building)) is not None:
        read(session, recording, now, settings=settings)
        session.flush()
        count += 1
    return count


def read(session: Session, recording: Recording, now: datetime, *, settings: Settings) -> None:
    """Read one recording: its traces join their events; a refusal is kept with its reason."""
    building = session.get_one(Building, recording.building_id, with_for_update=True)
    described = buildings.described(session, building)
    recording.kind, recording.state, recording.reason = "unknown", "read", None
    try:
        contents = formats.read(recording.name, data_of(session, recording), gains(session, building))
        recording.kind = contents.kind
        traces = formats.of_building(contents.traces, described.description.channels)
        _check_clock(traces, now)
    except FormatError as error:
        unit_is_missing = isinstance(error, UnknownUnitError)
        recording.kind = "waveforms" if unit_is_missing else recording.kind
        recording.state, recording.reason = "refused", _refusal(error, described)
        return
    recording.reason = _left_out(contents, described)
    if contents.kind == "station":
        session.flush()
        _read_again_with_gains(session, building)
    if traces:
        spans = [span(trace) for trace in traces]
        recording.start, recording.end = min(start for start, _ in spans), max(end for _, end in spans)
        session.flush()
        take_in = continuous.take_in if _is_continuous(described) else events.take_in
        take_in(session, building, recording, traces, now, settings=settings)


def _next_stored(session: Session, building: Building) -> Recording | None:
    waiting = select(Recording).where(Recording.building_id == building.id, Recording.state == "stored")
    return session.scalar(waiting.order_by(Recording.name.ilike("%.xml").desc(), Recording.id).limit(1))


def _read_again_with_gains(session: Session, building: Building) -> None:
    """What was refused, or left out in part, for want of a unit may be read now."""
    wanting = select(Recording).where(
        Recording.building_id == building.id, Recording.kind == "waveforms", Recording.reason.is_not(None)
    )
    for recording in session.scalars(wanting):
        if recording.sha256 is not None:
            recording.state = "stored"


def _is_continuous(described: BuildingFile) -> bool:
    return described.source is not None and described.source.data == "continuous"


def _check_clock(traces: Iterable[Trace], now: datetime) -> None:
    for trace in traces:
        start, end = span(trace)
        if start < CLOCK_SET or end > now + CLOCK_SLACK:
            raise FormatError(
                f"{trace.channel} was recorded from {start:%Y-%m-%d %H:%M:%S} to {end:%Y-%m-%d %H:%M:%S} UTC by its "
                f"clock, but it is {now:%Y-%m-%d %H:%M} now; set the logger's clock and mend the times of this file"
            )


def _refusal(error: FormatError, described: BuildingFile) -> str:
    """Why nothing of a file could be used; that its channels are not the building's goes before their unit."""
    known = [channel.id for channel in described.description.channels]
    if isinstance(error, UnknownUnitError) and not set(error.channels) & set(known):
        return f"no channel of this building: found {', '.join(error.channels)}; the building has {', '.join(known)}"
    return str(error)


def _left_out(contents: Contents, described: BuildingFile) -> str | None:
    """What of a file that was read could not be used, for the engineer; None if nothing."""
    known = {channel.id for channel in described.description.channels}
    there = [*(trace.channel for trace in contents.traces), *contents.without_unit]
    strangers = [channel for channel in dict.fromkeys(there) if channel not in known]
    unitless = tuple(channel for channel in contents.without_unit if channel in known)
    reasons = list(contents.remarks)
    if unitless:
        reasons.append(str(UnknownUnitError(unitless)))
    if strangers:
        reasons.append(f"channels that the building file does not name were left out: {', '.join(strangers)}")
    return "; ".join(reasons) or None
