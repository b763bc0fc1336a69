"""Which of an event's channels can be used, and what do they read on one time base?"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.description import BuildingDescription
from core.errors import RecordError
from core.quality import Finding
from core.record import Channel, Record, Segment
from core.sensors.assembly import Trace, joined, on_one_time_base
from core.sensors.screening import loss, missing, screened
from core.signals.conditioning import without_baseline

MOST_SAMPLES = 25_000_000
"""Of a channel: three hours at 2000 Hz, 69 hours at 100 Hz."""


@dataclass(frozen=True, slots=True, eq=False)
class Preparation:
    """What became of an event's segments."""

    record: Record | None
    """The usable channels, each about its position at rest; None if there is none."""
    findings: tuple[Finding, ...]


def prepared(segments: Sequence[Segment], description: BuildingDescription, rate: float) -> Preparation:
    """The channels that the description lists and that can be used, complete and on one time base.

    Args:
        segments: what was recorded, in any order; channels that the description does not list are ignored.
        description: of the building.
        rate: Hz, of the record.
    """
    wanted = [channel for channel in description.channels if channel.quantity != "temperature"]
    ids = {channel.id for channel in wanted}
    if too_long := _too_long([segment for segment in segments if segment.channel in ids], rate):
        return Preparation(None, (too_long,))
    pieces = _by_channel(segments)
    traces: dict[str, Trace] = {}
    found: list[Finding] = []
    for channel in wanted:
        if channel.id in pieces:
            trace, findings = _trace(pieces[channel.id], channel, description)
            found += findings
            if trace is not None:
                traces[channel.id] = trace
    found += missing(wanted, set(pieces), description)
    try:
        record, incomplete = _record(traces, wanted, description, rate)
    except RecordError as error:
        return Preparation(None, (*found, Finding("record", "fatal", str(error))))
    return Preparation(record, (*found, *incomplete))


def _too_long(segments: Sequence[Segment], rate: float) -> Finding | None:
    """Records that the memory would not hold on one time base."""
    if not segments:
        return None
    ends = [segment.start.timestamp() + segment.samples.size / segment.rate for segment in segments]
    seconds = max(ends) - min(segment.start.timestamp() for segment in segments)
    count = seconds * max(rate, *(segment.rate for segment in segments))
    if count <= MOST_SAMPLES:
        return None
    words = (
        f"the event lasts {seconds / 3600:.3g} h, {count:.3g} samples a channel; at most {MOST_SAMPLES:.3g} are used"
    )
    return Finding("record", "fatal", words)


def _by_channel(segments: Sequence[Segment]) -> Mapping[str, Sequence[Segment]]:
    pieces: dict[str, list[Segment]] = defaultdict(list)
    for segment in segments:
        pieces[segment.channel].append(segment)
    return pieces


def _trace(
    pieces: Sequence[Segment], channel: Channel, description: BuildingDescription
) -> tuple[Trace | None, tuple[Finding, ...]]:
    lost = loss(channel, description)
    try:
        trace, overlaps = joined(pieces)
    except RecordError as error:
        return None, (Finding("record", lost, f"the channel {error}", channel.id),)
    usable, findings = screened(trace, channel, lost)
    return usable, (*overlaps, *findings)


def _record(
    traces: Mapping[str, Trace], wanted: Sequence[Channel], description: BuildingDescription, rate: float
) -> tuple[Record, tuple[Finding, ...]]:
    """The traces that cover the whole event, and a finding for every other."""
    used = tuple(channel for channel in wanted if channel.id in traces)
    if not used:
        raise RecordError("no channel of the description can be used; see the other findings")
    record = on_one_time_base(traces, used, rate)
    whole = np.array([bool(np.isfinite(row).all()) for row in record.samples])
    if not whole.any():
        raise RecordError("no channel covers the whole event; send the rest and analyse again")
    kept = tuple(channel for channel, complete in zip(used, whole, strict=True) if complete)
    rows = np.array([without_baseline(row, rate) for row in record.samples[whole]])
    return replace(record, channels=kept, samples=rows), _incomplete(record, description)


def _incomplete(record: Record, description: BuildingDescription) -> tuple[Finding, ...]:
    absent = np.sum(~np.isfinite(record.samples), axis=1) / record.rate
    return tuple(
        Finding(
            "gap",
            loss(channel, description),
            f"does not cover {seconds:.3g} s of the event and is left out; send the rest and analyse again",
            channel.id,
            float(seconds),
        )
        for channel, seconds in zip(record.channels, absent, strict=True)
        if seconds
    )
