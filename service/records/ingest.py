"""Intake of files, for the poller and the import command alike: the bytes first, then their contents."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from types import MappingProxyType

from sqlalchemy import ColumnElement, TextClause, select, update
from sqlalchemy.orm import Session

from service import formats, parsing
from service.buildings.description import BuildingFile
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.formats import Contents, FormatError, Gain, Trace, UnknownUnitError
from service.formats.trace import Span, extent, overlapping
from service.parsing import ParserDiedError
from service.records import continuous, events
from service.records.file_store import LostFileError
from service.records.originals import is_there, secured
from service.records.recordings import Units, data_of, gains_in, storable, store, units_of
from service.records.tables import REJECTED, STORED, Recording
from service.records.trigger import check_gaps
from service.settings import Settings
from service.version import VERSION

CLOCK_SET = datetime(1980, 1, 1, tzinfo=UTC)
"""No strong-motion logger with a clock is older: an earlier time means a clock that was never set."""
CLOCK_SLACK = timedelta(days=1)
"""Lead over the service's clock beyond which a recorder's clock is wrong. Not tuned."""


FAILED_BEFORE = (REJECTED, Recording.failures > 0, Recording.version != VERSION)
"""Conditions on a recording at which an earlier version of the code failed."""


class NotYetError(FormatError):
    """Records that end later than it is by the service's clock, which may be the one that is wrong."""

    def __init__(self, message: str, span: Span) -> None:
        super().__init__(message)
        self.span = span


@dataclass(frozen=True, slots=True)
class Parsed:
    """The contents of a recording's bytes, valid as long as its channels have these gains."""

    gains: Mapping[str, Gain]
    contents: Contents | FormatError


def ingest(
    session: Session, building: Building, name: str, origin: str, data: bytes, now: datetime, *, settings: Settings
) -> Recording:
    """Keep a file, read it, and join its records to their events, in one transaction.

    Where a crash must not lose the bytes, commit between `recordings.store`, `begin` and `take_in`.
    """
    recording = store(session, building, name, origin, secured(data, settings.storage), now)
    while (waiting := next_stored(session, building)) is not None:
        take_in(session, waiting, parse(session, waiting, settings=settings), now, settings=settings)
        session.flush()
    return recording


def next_stored(session: Session, building: Building, passed: Collection[int] = ()) -> Recording | None:
    """The building's next recording to read, station files first, except those whose ids are passed over."""
    waiting = select(Recording).where(Recording.building_id == building.id, STORED)
    if passed:
        waiting = waiting.where(Recording.id.not_in(passed))
    return session.scalar(waiting.order_by(Recording.name.ilike("%.xml").desc(), Recording.id).limit(1))


def begin(session: Session, recording: Recording, *, settings: Settings) -> bool:
    """Count an attempt at reading a recording before making it, so that a file that ends the process is given up too.

    Returns:
        False if all attempts are used up: the recording is rejected.
    """
    recording.version = VERSION
    if recording.failures < settings.jobs.attempts:
        recording.failures += 1
        return True
    _give_up(recording, "the service ended while it was read")
    return False


def not_begun(recording: Recording) -> None:
    """Take back an attempt at a recording that failed for no reason of its own, such as a database that went away."""
    recording.failures = max(recording.failures - 1, 0)


def parse(
    session: Session,
    recording: Recording,
    *,
    settings: Settings,
    units: Units | None = None,
    at_hand: Mapping[str, bytes] = MappingProxyType({}),
) -> Parsed:
    """Read the bytes of a recording in another process and within its limits; use a session that blocks no writer.

    Args:
        session: to read with what is not given.
        recording: to read.
        settings: of the parser and the store.
        units: where the units of its channels are stated.
        at_hand: bytes that were just stored, by their SHA-256.

    Raises:
        ParserDiedError: the process ended or exceeded its limits.
        StoreAwayError, LostFileError: there are no bytes to read, as `originals.read` says.
    """
    units = units or units_of(session, session.get_one(Building, recording.building_id))
    data = at_hand.get(str(recording.sha256))
    if data is None:
        data = data_of(session, recording, settings)
    known = gains_in(session, units, settings)
    try:
        return Parsed(known, parsing.read(recording.name, data, known, parsing.limits(settings)))
    except FormatError as error:
        return Parsed(known, error)


def take_in(session: Session, recording: Recording, parsed: Parsed, now: datetime, *, settings: Settings) -> Units:
    """Join the traces of a recording to their events, or reject the recording with a reason.

    Returns:
        Sources of the units of the building's channels, with those of this recording.
    """
    building = locked(session, recording.building_id)
    session.refresh(recording)
    units = units_of(session, building)
    if recording.state == "stored":  # otherwise another process was quicker
        _take_in(session, building, units, recording, parsed, now, settings=settings)
    return units_of(session, building, units.described) if recording.kind == "station" else units


def _take_in(
    session: Session,
    building: Building,
    units: Units,
    recording: Recording,
    parsed: Parsed,
    now: datetime,
    *,
    settings: Settings,
) -> None:
    recording.failures = 0
    if parsed.gains != gains_in(session, units, settings):  # a station file came meanwhile
        return
    described = units.described
    recording.kind, recording.state, recording.reason, recording.version = "unknown", "read", None, VERSION
    try:
        contents, traces = _usable(recording, parsed.contents, described, now, settings)
    except FormatError as error:
        if isinstance(error, UnknownUnitError):
            recording.kind = "waveforms"
        recording.state, recording.reason = "refused", storable(_refusal(recording.name, error, described))
        # a rejected recording has times only if it is read again once they are past
        recording.start, recording.end = error.span if isinstance(error, NotYetError) else (None, None)
        return
    omitted = _omitted(contents, described)
    recording.reason = None if omitted is None else storable(omitted)
    if contents.kind == "station":
        session.flush()
        _read_again_with_gains(session, building)
    if traces:
        recording.start, recording.end = extent(traces)
        join = continuous.take_in if _is_continuous(described) else events.take_in
        join(session, building, described, recording, traces, now, settings=settings)


def _usable(
    recording: Recording, contents: Contents | FormatError, described: BuildingFile, now: datetime, settings: Settings
) -> tuple[Contents, Sequence[Trace]]:
    """The contents and the building's traces, once they pass every check."""
    if isinstance(contents, FormatError):
        raise contents
    recording.kind = contents.kind
    traces = formats.of_building(contents.traces, described.description.channels)
    _check_clock(traces, now)
    _check_length(traces, described, settings)
    return contents, traces


def reading_failed(recording: Recording, error: Exception, *, settings: Settings) -> None:
    """Note a failed attempt at a recording: it is tried again at the next poll, and rejected after the last attempt."""
    is_said = isinstance(error, ParserDiedError | LostFileError)
    problem = str(error) if is_said else f"reading it failed ({type(error).__name__}: {error})"
    if recording.failures < settings.jobs.attempts:
        recording.reason = f"{storable(problem)}; it is tried again at the next poll"
        return
    _give_up(recording, storable(problem))


def _give_up(recording: Recording, problem: str) -> None:
    wanted = "`menshin building update`, or another version of menshin, reads it again"
    recording.state, recording.reason = "refused", f"{problem}, {recording.failures} times; {wanted}"


def read_again_with_this_version(session: Session, building: Building) -> None:
    """Read again the recordings at which an earlier version of the code failed."""
    of_building = update(Recording).where(Recording.building_id == building.id, *FAILED_BEFORE)
    session.execute(of_building.values(state="stored", failures=0))


def past_by(moment: ColumnElement[datetime] | datetime) -> Sequence[ColumnElement[bool] | TextClause]:
    """Conditions on a recording that was rejected as of the future and ends by a moment, CLOCK_SLACK from now."""
    return REJECTED, Recording.end <= moment, Recording.content.has(is_there())


def read_again_what_is_past(session: Session, building: Building, now: datetime) -> None:
    """Read again the recordings that were rejected as of the future and no longer are: the clock has been set."""
    of_building = update(Recording).where(Recording.building_id == building.id, *past_by(now + CLOCK_SLACK))
    session.execute(of_building.values(state="stored", failures=0))


def _read_again_with_gains(session: Session, building: Building) -> None:
    """Read again the recordings that were rejected, or used in part, because a unit was missing."""
    wanting = select(Recording).where(
        Recording.building_id == building.id,
        Recording.kind == "waveforms",
        Recording.reason.is_not(None),
        Recording.content.has(is_there()),
    )
    for recording in session.scalars(wanting):
        recording.state = "stored"


def _is_continuous(described: BuildingFile) -> bool:
    return described.source is not None and described.source.data == "continuous"


def _check_clock(traces: Sequence[Trace], now: datetime) -> None:
    for trace in traces:
        start, end = trace.span
        if start >= CLOCK_SET and end <= now + CLOCK_SLACK:
            continue
        problem = (
            f"{trace.channel} was recorded from {start:%Y-%m-%d %H:%M:%S} to {end:%Y-%m-%d %H:%M:%S} UTC by its "
            f"clock, but it is {now:%Y-%m-%d %H:%M} now; set the logger's clock and correct the times of this file"
        )
        raise FormatError(problem) if start < CLOCK_SET else NotYetError(problem, extent(traces))


def _check_length(traces: Iterable[Trace], described: BuildingFile, settings: Settings) -> None:
    """Reject records too long for one earthquake, or too long for the memory once their gaps are filled."""
    if _is_continuous(described):
        check_gaps([trace for trace in traces if trace.quantity == "acceleration"])
        return
    for group in overlapping(traces, lambda trace: trace.span, timedelta(seconds=settings.event.tolerance)):
        start, end = extent(group)
        if (length := (end - start).total_seconds()) > settings.event.longest:
            raise FormatError(
                f"the record lasts {length / 3600:.3g} h, from {start:%Y-%m-%d %H:%M:%S} to {end:%Y-%m-%d %H:%M:%S} "
                f"UTC; at most {settings.event.longest / 3600:.3g} h count as one earthquake. If it is a "
                f'continuous record, data = "continuous" in [source] of the building file cuts the earthquakes out'
            )


def _refusal(name: str, error: FormatError, described: BuildingFile) -> str:
    """The file, and why it cannot be used; channels of another building are reported before a missing unit."""
    known, problem = [channel.id for channel in described.description.channels], str(error)
    if isinstance(error, UnknownUnitError) and not set(error.channels) & set(known):
        problem = f"no channel of this building: found {', '.join(error.channels)}; the building has {', '.join(known)}"
    return problem if name in problem else f"{name}: {problem}"


def _omitted(contents: Contents, described: BuildingFile) -> str | None:
    """The parts of a file that could not be used, for the engineer; None if all could."""
    known = {channel.id for channel in described.description.channels}
    there = [*(trace.channel for trace in contents.traces), *contents.without_unit]
    strangers = [channel for channel in dict.fromkeys(there) if channel not in known]
    unitless = tuple(channel for channel in contents.without_unit if channel in known)
    reasons = list(contents.remarks)
    if unitless:
        reasons.append(str(UnknownUnitError(unitless)))
    if strangers:
        reasons.append(f"channels that the building file does not name were ignored: {', '.join(strangers)}")
    return "; ".join(reasons) or None
