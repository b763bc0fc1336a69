"""Did data stop? What the clock, and what is stored, say of it: pure functions of both."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from service.alerts.candidates import Found
from service.alerts.words import of_duration

GIB = 2**30
STEPS = (1, 2, *(10**power for power in range(1, 10)))
"""Numbers of files from which on people are told again."""
FILES = 3
"""Of an earthquake that a sentence names."""
RELIEF = 1.25
"""Part of the reserve that must be free before a disk counts as no longer full: it shall not be told to and fro."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long is too long, from the settings."""

    source: timedelta
    continuous: timedelta
    """Without a good record, of a source that records all the time."""
    quiet: timedelta
    """The same of one that gives earthquakes."""
    misses: int
    """Earthquakes in a row without a channel."""
    clock: timedelta
    worker: timedelta
    reserve: int
    """Bytes that ought to be free."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """How a building's source is doing."""

    is_continuous: bool
    watched_since: datetime
    attempted_at: datetime | None
    succeeded_at: datetime | None
    failing_since: datetime | None
    error: str | None
    described_at: datetime
    """Since when the building file that names it is in force."""
    last_record: datetime | None
    """End of the last good one."""
    ahead: timedelta
    """By which that ended after it came: none ought to."""
    came_at: datetime | None
    """When it came."""
    server_ahead: timedelta | None
    """Of its clock against ours, at the last look; None where it does not say."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rejected:
    """A file of which nothing could be used."""

    name: str
    at: datetime
    """When it came."""
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """The channels that gave a good record in an earthquake."""

    event: int
    start: datetime
    channels: Collection[str]
    findings: Mapping[str, str] = field(default_factory=dict)
    """What screening found, in words, of the channels that it took for dead."""
    files: tuple[str, ...] = ()
    """Names of what was received of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """The jobs of a building that nobody has finished."""

    oldest: datetime | None
    """Since when the oldest one waits, or its worker was heard of last."""
    last_progress: datetime | None
    """When any job of the service was finished last."""


def stopped_source(source: Source, patience: Patience, now: datetime) -> Iterator[Found]:
    """The monitoring server has not answered for too long, or a look at it does not come to an end.

    One that has never answered since its building file came into force may have a wrong address: there is no patience
    with it.
    """
    looking = source.attempted_at is not None and source.attempted_at > (source.succeeded_at or source.watched_since)
    began = source.failing_since or (source.attempted_at if looking else None)
    if began is None:
        return
    has_answered = source.succeeded_at is not None and source.succeeded_at >= source.described_at
    if source.failing_since is not None and not has_answered:
        yield _found(
            "source",
            began,
            began,
            "The monitoring server has never answered at its address",
            ("No earthquake is watched until it answers.", f"Menshin found: {source.error}."),
            {"error": source.error},
        )
    elif now - began > patience.source:
        said = f"It says: {source.error}." if source.failing_since else "A look at it does not come to an end."
        yield _found(
            "source",
            began,
            began + patience.source,
            f"The monitoring server has not answered for more than {of_duration(patience.source)}",
            ("Earthquakes from then on are not watched until it answers again.", said),
            {"error": source.error},
        )


def stopped_records(source: Source, patience: Patience, now: datetime) -> Iterator[Found]:
    """The server answers, but there has been no good record for too long."""
    longest = patience.continuous if source.is_continuous else patience.quiet
    began = max(source.last_record or source.watched_since, source.watched_since)
    if now - began > longest:
        yield _found(
            "record",
            began,
            began + longest,
            f"No record that can be used has come for more than {of_duration(longest)}",
            ("The recorder may have stopped though its server answers: it ought to be looked at.",),
            {"last_record": None if source.last_record is None else source.last_record.isoformat()},
        )


def rejected_files(files: Sequence[Rejected]) -> Iterator[Found]:
    """Files of which nothing could be used, in one finding, however many there are.

    Its words change only when there are ten times as many: people are not told of each.

    Args:
        files: those that count still, the earliest first.
    """
    if not files:
        return
    count, first = len(files), files[0]
    least = max(step for step in STEPS if step <= count)
    yield _found(
        "rejected",
        first.at,
        first.at,
        "A file could not be used" if count == 1 else f"{least} files or more could not be used",
        (
            "What they recorded is missing from the results. The page of the building's records lists every file with "
            "its reason.",
            f"The first is {first.name}: {first.reason}.",
        ),
        {"files": count, "first": first.name, "reason": first.reason},
    )


def wrong_clocks(source: Source, patience: Patience) -> Iterator[Found]:
    """Records come from the future, or the server's clock and ours differ."""
    if source.ahead > patience.clock and source.came_at is not None:
        yield _found(
            "clock/recorder",
            source.came_at,
            source.came_at,
            f"The recorder's clock is ahead by more than {of_duration(patience.clock)}",
            ("Its records end later than they came, so the times of earthquakes are wrong: its clock wants setting.",),
            {"ahead": source.ahead.total_seconds()},
        )
    offset = source.server_ahead
    if offset is not None and abs(offset) > patience.clock and source.attempted_at is not None:
        yield _found(
            "clock/server",
            source.attempted_at,
            source.attempted_at,
            f"The clocks of the monitoring server and of this one differ by more than {of_duration(patience.clock)}",
            (f"The server's is {'ahead' if offset > timedelta(0) else 'behind'}: one of the two wants setting.",),
            {"ahead": offset.total_seconds()},
        )


def dead_channels(
    sightings: Sequence[Sighting], channels: Collection[str], seen: Collection[str], patience: Patience
) -> Iterator[Found]:
    """Channels without a good record in the latest earthquakes, of those that ever gave one.

    Args:
        sightings: of the latest earthquakes, in order of time.
        channels: of the building.
        seen: channels that ever gave a record.
        patience: how many misses are too many.
    """
    for channel in sorted(set(channels) & set(seen)):
        missed = _missed(sightings, channel)
        if len(missed) >= patience.misses:
            raised = missed[patience.misses - 1]
            yield _found(
                f"channel/{channel}",
                missed[0].start,
                raised.start,
                f"Sensor {channel} gave no good record in {patience.misses} earthquakes or more",
                (
                    "What it measured is missing from the results: the sensor or its line ought to be looked at.",
                    _silence(missed[-1], channel),
                ),
                {"events": [one.event for one in missed], "files": list(missed[-1].files)},
                (channel,),
                tuple(one.event for one in missed),
            )


def stuck_work(work: Work, patience: Patience, now: datetime) -> Iterator[Found]:
    """Work waits for too long while nothing at all gets done: a long queue that moves is no fault."""
    if work.oldest is None or now - work.oldest <= patience.worker:
        return
    if work.last_progress is not None and now - work.last_progress <= patience.worker:
        return
    began = max(work.oldest, work.last_progress or work.oldest)
    yield _found(
        "worker",
        began,
        began + patience.worker,
        f"Records have waited for their analysis for more than {of_duration(patience.worker)}",
        ("They came in, but nothing is said of them until the worker runs again (menshin work, or menshin up).",),
        {"oldest": work.oldest.isoformat()},
    )


def full_disk(free: int, patience: Patience, since: datetime | None, now: datetime) -> Iterator[Found]:
    """The disk of the database is nearly full.

    Args:
        free: bytes.
        patience: what ought to be free.
        since: when it became so; None if people were not told that it is.
        now: aware time.
    """
    if free < patience.reserve * (1.0 if since is None else RELIEF):
        began = since or now
        yield _found(
            "disk",
            began,
            began,
            f"Less than {patience.reserve / GIB:.1f} GiB of disk is free for the database",
            ("Once the disk is full no earthquake can be kept: make room, or give it a larger disk.",),
            {},
        )


def _silence(last: Sighting, channel: str) -> str:
    """What its last earthquake shows of a dead channel, and in which files."""
    found = last.findings.get(channel, "no samples of it came").rstrip(".")
    files = f" ({', '.join(last.files[:FILES])})" if last.files else ""
    return f"In the latest earthquake, event {last.event}{files}: {found}."


def _missed(sightings: Sequence[Sighting], channel: str) -> list[Sighting]:
    """The earthquakes since the last one with a good record of the channel."""
    good = [number for number, one in enumerate(sightings) if channel in one.channels]
    return list(sightings[good[-1] + 1 :] if good else sightings)


def _found(
    cause: str,
    began_at: datetime,
    raised_at: datetime,
    summary: str,
    sentences: tuple[str, ...],
    evidence: Mapping[str, object],
    channels: tuple[str, ...] = (),
    event_ids: tuple[int, ...] = (),
) -> Found:
    return Found(
        cause=cause,
        kind="data",
        is_sure=True,
        began_at=began_at,
        raised_at=raised_at,
        channels=channels,
        event_ids=event_ids,
        evidence=dict(evidence),
        summary=summary,
        sentences=sentences,
    )
