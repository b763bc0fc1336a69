"""Periodic checks of the data: pure functions of stored facts and the time, each of which yields alert candidates."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from service.alerts import texts
from service.alerts.candidates import AlertCandidate
from service.alerts.texts import Wording, duration

GIB = 2**30
STEPS = (1, 2, *(10**power for power in range(1, 10)))
"""Numbers of rejected files at which the wording changes, and a new message is due."""
FILES = 3
"""Files of an earthquake that a sentence names."""
RELIEF = 1.25
"""Multiple of the reserve that must be free before a full disk counts as mended, so that the alert does not flap."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """Durations and amounts, from the settings, beyond which a check raises an alert."""

    source: timedelta
    continuous: timedelta
    """Without a usable record, for a source that records all the time."""
    quiet: timedelta
    """The same for a source that records earthquakes only."""
    misses: int
    """Earthquakes in a row without a channel."""
    clock: timedelta
    worker: timedelta
    reserve: int
    """Bytes of disk that should be free."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """State of a building's source."""

    is_continuous: bool
    watched_since: datetime
    attempted_at: datetime | None
    succeeded_at: datetime | None
    failing_since: datetime | None
    error: str | None
    described_at: datetime
    """Time when the building file with the source took effect."""
    last_record: datetime | None
    """End of the last usable record."""
    ahead: timedelta
    """Time from its arrival to its end; positive only with a wrong clock."""
    came_at: datetime | None
    """Arrival of that record."""
    server_ahead: timedelta | None
    """Offset of the server's clock at the last request; None where it gives no time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rejected:
    """Files of which nothing could be used."""

    number: int
    name: str
    """The earliest one's, like time and reason."""
    at: datetime
    """Time of arrival."""
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """The channels that gave a usable record in an earthquake."""

    event: int
    start: datetime
    channels: Collection[str]
    findings: Mapping[str, str] = field(default_factory=dict)
    """Finding of the data quality check for each dead channel."""
    files: tuple[str, ...] = ()
    """Names of its files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """The unfinished jobs of a building."""

    oldest: datetime | None
    """Time since which the oldest one waits, or its worker has been silent."""
    last_progress: datetime | None
    """Time when the latest job of the service ended."""


def stopped_source(source: Source, thresholds: Thresholds, now: datetime) -> Iterator[AlertCandidate]:
    """The monitoring server has not answered for too long, or a request to it does not end.

    A server that has not answered since its building file took effect may have a wrong address: that is reported at
    once.
    """
    has_pending_request = source.attempted_at is not None and source.attempted_at > (
        source.succeeded_at or source.watched_since
    )
    began = source.failing_since or (source.attempted_at if has_pending_request else None)
    if began is None:
        return
    has_answered = source.succeeded_at is not None and source.succeeded_at >= source.described_at
    if source.failing_since is not None and not has_answered:
        never = source.succeeded_at is None
        wording = texts.SERVER_NEVER_ANSWERED if never else texts.SERVER_SILENT_SINCE_CHANGE
        wording = wording.filled(error=source.error)
        yield _candidate("source", began, began, wording, {"error": source.error})
    elif now - began > thresholds.source:
        is_failing = source.failing_since is not None
        detail = texts.SERVER_ERROR.format(error=source.error) if is_failing else texts.REQUEST_NEVER_ENDS
        wording = texts.SERVER_SILENT.filled(duration=duration(thresholds.source), detail=detail)
        yield _candidate("source", began, began + thresholds.source, wording, {"error": source.error})


def stopped_records(source: Source, thresholds: Thresholds, now: datetime) -> Iterator[AlertCandidate]:
    """The server answers, but there has been no usable record for too long."""
    longest = thresholds.continuous if source.is_continuous else thresholds.quiet
    began = max(source.last_record or source.watched_since, source.watched_since)
    if now - began > longest:
        last = None if source.last_record is None else source.last_record.isoformat()
        wording = texts.NO_USABLE_RECORD.filled(duration=duration(longest))
        yield _candidate("record", began, began + longest, wording, {"last_record": last})


def rejected_files(files: Rejected) -> Iterator[AlertCandidate]:
    """Files of which nothing could be used, as one candidate; its wording changes at every tenfold number only."""
    least = max(step for step in STEPS if step <= files.number)
    count = texts.ONE_FILE if files.number == 1 else texts.SEVERAL_FILES.format(least=least)
    wording = texts.FILES_REJECTED.filled(count=count, name=files.name, reason=files.reason)
    evidence = {"files": files.number, "first": files.name, "reason": files.reason}
    yield _candidate("rejected", files.at, files.at, wording, evidence)


def wrong_clocks(source: Source, thresholds: Thresholds) -> Iterator[AlertCandidate]:
    """Records come from the future, or the server's clock and ours differ."""
    tolerance = duration(thresholds.clock)
    if source.ahead > thresholds.clock and source.came_at is not None:
        wording = texts.RECORDER_CLOCK.filled(tolerance=tolerance)
        evidence = {"ahead": source.ahead.total_seconds()}
        yield _candidate("clock/recorder", source.came_at, source.came_at, wording, evidence)
    offset = source.server_ahead
    if offset is not None and abs(offset) > thresholds.clock and source.attempted_at is not None:
        ahead = texts.AHEAD if offset > timedelta(0) else texts.BEHIND
        wording, evidence = (
            texts.SERVER_CLOCK.filled(tolerance=tolerance, ahead=ahead),
            {"ahead": offset.total_seconds()},
        )
        yield _candidate("clock/server", source.attempted_at, source.attempted_at, wording, evidence)


def dead_channels(
    sightings: Sequence[Sighting], channels: Collection[str], seen: Collection[str], thresholds: Thresholds
) -> Iterator[AlertCandidate]:
    """Channels without a usable record in the latest earthquakes, of those that ever gave one.

    Args:
        sightings: of the latest earthquakes, in order of time.
        channels: of the building.
        seen: channels that ever gave a record.
        thresholds: how many misses raise an alert.
    """
    for channel in sorted(set(channels) & set(seen)):
        missed = _missed(sightings, channel)
        if len(missed) < thresholds.misses:
            continue
        first, raised, last = missed[0], missed[thresholds.misses - 1], missed[-1]
        wording = texts.DEAD_CHANNEL.filled(
            channel=channel,
            misses=thresholds.misses,
            event=last.event,
            files=f" ({', '.join(last.files[:FILES])})" if last.files else "",
            finding=last.findings.get(channel, texts.NO_SAMPLES).rstrip("."),
        )
        events = tuple(one.event for one in missed)
        evidence = {"events": list(events), "files": list(last.files)}
        yield _candidate(f"channel/{channel}", first.start, raised.start, wording, evidence, (channel,), events)


def silent_channels(silent: Mapping[str, datetime], thresholds: Thresholds, now: datetime) -> Iterator[AlertCandidate]:
    """Channels that send nothing in a live stream whose other channels send.

    Args:
        silent: time since which each one is silent.
        thresholds: how long a source may be silent.
        now: aware time.
    """
    for channel, began in sorted(silent.items()):
        if now - began > thresholds.source:
            wording = texts.SILENT_CHANNEL.filled(channel=channel, duration=duration(thresholds.source))
            evidence = {"silent_since": began.isoformat()}
            yield _candidate(f"channel/{channel}", began, began + thresholds.source, wording, evidence, (channel,))


def stuck_work(work: Work, thresholds: Thresholds, now: datetime) -> Iterator[AlertCandidate]:
    """Work waits for too long while no job at all is finished: a long queue that moves is no fault."""
    if work.oldest is None or now - work.oldest <= thresholds.worker:
        return
    if work.last_progress is not None and now - work.last_progress <= thresholds.worker:
        return
    began = max(work.oldest, work.last_progress or work.oldest)
    wording = texts.WORK_WAITS.filled(duration=duration(thresholds.worker))
    yield _candidate("worker", began, began + thresholds.worker, wording, {"oldest": work.oldest.isoformat()})


def full_disk(free: int, thresholds: Thresholds, since: datetime | None, now: datetime) -> Iterator[AlertCandidate]:
    """The disk of the database is nearly full.

    Args:
        free: bytes.
        thresholds: how much should be free.
        since: beginning of the open alert about it; None if there is none.
        now: aware time.
    """
    if free < thresholds.reserve * (1.0 if since is None else RELIEF):
        began = since or now
        yield _candidate("disk", began, began, texts.DISK_FULL.filled(gibibytes=thresholds.reserve / GIB), {})


def _missed(sightings: Sequence[Sighting], channel: str) -> list[Sighting]:
    """The earthquakes since the last one with a usable record of the channel."""
    good = [number for number, one in enumerate(sightings) if channel in one.channels]
    return list(sightings[good[-1] + 1 :] if good else sightings)


def _candidate(
    cause: str,
    began_at: datetime,
    raised_at: datetime,
    wording: Wording,
    evidence: Mapping[str, object],
    channels: tuple[str, ...] = (),
    event_ids: tuple[int, ...] = (),
) -> AlertCandidate:
    return AlertCandidate(
        cause=cause,
        kind="data",
        is_sure=True,
        began_at=began_at,
        raised_at=raised_at,
        channels=channels,
        event_ids=event_ids,
        evidence=dict(evidence),
        summary=wording.summary,
        sentences=wording.sentences,
    )
