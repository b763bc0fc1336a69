"""The one way in for files, from the poller, the import command or a test: bytes first, then what they hold."""

from collections.abc import Collection, Iterable
from datetime import UTC, datetime, timedelta

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service import buildings, formats
from service.database import Building, Recording
from service.formats import Contents, FormatError, Trace, UnknownUnitError
from service.intake import continuous, events
from service.intake.contents import data_of, gains
from service.intake.recordings import store
from service.intake.spans import span
from service.settings import Settings
from service.toml_files.building_file import BuildingFile
from service.version import VERSION

CLOCK_SET = datetime(1980, 1, 1, tzinfo=UTC)
"""No strong-motion logger with a clock is older: earlier times are those of a clock that was never set."""
CLOCK_SLACK = timedelta(days=1)


def ingest(
    session: Session, building: Building, name: str, origin: str, data: bytes, now: datetime, *, settings: Settings
) -> Recording:
    """Keep a file, read it, and join its records to their events, in one transaction.

    Where a crash must not lose the bytes, commit between `recordings.store` and `read`.
    """
    recording = store(session, building, name, origin, data, now)
    while (waiting := next_stored(session, building)) is not None:
        read(session, waiting, now, settings=settings)
        session.flush()
    return recording


def next_stored(session: Session, building: Building, passed: Collection[int] = ()) -> Recording | None:
    """What is to be read next of the building: station files first; none of the ids that are passed over."""
    waiting = select(Recording).where(
        Recording.building_id == building.id, Recording.state == "stored", Recording.id.not_in(passed)
    )
    return session.scalar(waiting.order_by(Recording.name.ilike("%.xml").desc(), Recording.id).limit(1))


def read(session: Session, recording: Recording, now: datetime, *, settings: Settings) -> None:
    """Read one recording that is stored: its traces join their events; a refusal is kept with its reason."""
    building = session.get_one(Building, recording.building_id, with_for_update=True)
    session.refresh(recording)
    if recording.state != "stored":  # another process was quicker
        return
    described = buildings.described(session, building)
    recording.kind, recording.state, recording.reason = "unknown", "read", None
    recording.failures, recording.version = 0, VERSION
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


def went_wrong(recording: Recording, error: Exception, *, settings: Settings) -> None:
    """The code failed at a recording: it is tried again at the next look, and refused after as many as are set."""
    recording.failures, recording.version = recording.failures + 1, VERSION
    found = f"reading it went wrong ({type(error).__name__}: {error})".replace("\0", "\N{REPLACEMENT CHARACTER}")
    if recording.failures < settings.job_attempts:
        recording.reason = f"{found}; it is tried again at the next look"
        return
    wanted = "`menshin building update`, or another version of menshin, reads it again"
    recording.state, recording.reason = "refused", f"{found}, {recording.failures} times; {wanted}"


def read_again_with_this_version(session: Session, building: Building) -> None:
    """What an earlier version of the code failed at may go better now."""
    failed = (Recording.building_id == building.id, Recording.state == "refused", Recording.failures > 0)
    session.execute(update(Recording).where(*failed, Recording.version != VERSION).values(state="stored", failures=0))


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
