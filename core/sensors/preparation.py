"""Usable channels of an event, joined from their segments, screened, and brought onto one time base."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.record import Channel, Finding, Record, Segment, Trace
from core.sensors.screening import loss, missing, screened
from core.signals.conditioning import SAME_INSTANT, SAME_RATE, resampled, without_baseline

MOST_SAMPLES = 25_000_000
"""Samples of a channel at most: three hours at 2000 Hz, 69 hours at 100 Hz. A choice: 200 MB."""
SAME_VALUE = 1e-6
"""Difference, over the channel's largest value, within which two records of one sample agree. A choice: the resolution
of a 20-bit recorder."""
SHARE_OF_SPAN = 0.9
"""Share of the longest channel's duration below which a channel does not shorten the common time base. Not tuned."""


@dataclass(frozen=True, slots=True, eq=False)
class Preparation:
    """Result of preparing an event's segments."""

    record: Record | None
    """The usable channels, each relative to its position at rest; None if there is none."""
    findings: tuple[Finding, ...]


def prepared(segments: Sequence[Segment], description: BuildingDescription, rate: float) -> Preparation:
    """The usable channels of the description, complete and on one time base.

    Args:
        segments: recorded pieces, in any order; channels that are not in the description are ignored.
        description: of the building.
        rate: Hz, of the record.
    """
    wanted = [channel for channel in description.channels if channel.quantity != "temperature"]
    ids = {channel.id for channel in wanted}
    if too_long := _too_long([segment for segment in segments if segment.channel in ids], rate):
        return Preparation(None, (too_long,))
    pieces = _by_channel(segments)
    traces: dict[str, Trace] = {}
    quality: list[Finding] = []
    for channel in wanted:
        if channel.id in pieces:
            trace, findings = _trace(pieces[channel.id], channel, description)
            quality += findings
            if trace is not None:
                traces[channel.id] = trace
    quality += missing(wanted, set(pieces), description)
    try:
        record, incomplete = _record(traces, wanted, description, rate)
    except RecordError as error:
        return Preparation(None, (*quality, Finding("record", "fatal", str(error))))
    return Preparation(record, (*quality, *incomplete))


def joined(segments: Sequence[Segment]) -> tuple[Trace, tuple[Finding, ...]]:
    """Segments of one channel as one trace, with a finding if they overlap.

    A segment that begins between two samples of the first one is resampled at its instants. Where two segments overlap
    and differ, the earlier one counts.

    Raises:
        RecordError: no segment has a sample, the rates differ, or a start has no time zone.
    """
    pieces = sorted((s for s in segments if s.samples.size), key=lambda segment: (segment.start, -segment.samples.size))
    if not pieces:
        raise RecordError("has no samples; send a file with samples")
    if any(piece.start.tzinfo is None for piece in pieces):
        raise RecordError("starts at a time without a time zone; give one, such as UTC")
    rate = pieces[0].rate
    if not rate > 0 or any(abs(piece.rate / rate - 1) > SAME_RATE for piece in pieces):
        raise RecordError(f"has rates {sorted({piece.rate for piece in pieces})} Hz; it needs one rate above 0 Hz")
    start = pieces[0].start
    placed = [_placed(piece, start) for piece in pieces]
    samples = np.full(max(first + values.size for first, values in placed), np.nan)
    twice = contradicting = 0
    for first, values in placed:
        there = samples[first : first + values.size]
        both = np.isfinite(there) & np.isfinite(values)
        twice += int(both.sum())
        contradicting += int(np.sum(np.abs(there - values)[both] > SAME_VALUE * np.abs(values[both]).max(initial=0.0)))
        there[~np.isfinite(there)] = values[~np.isfinite(there)]
    return Trace(start, rate, samples), _overlap(pieces[0].channel, twice, contradicting, rate)


def on_one_time_base(traces: Mapping[str, Trace], channels: Sequence[Channel], rate: float) -> Record:
    """Record of all channels at one rate, from the latest start to the earliest end.

    Channels that cover less than 90 % of the longest do not shorten the time base: they end in NaN. Channels with NaN
    inside, which a filter would spread, are NaN throughout.

    Args:
        traces: by channel id.
        channels: of the record, in order; each has a trace.
        rate: Hz.

    Raises:
        RecordError: the channels have no time in common, or one cannot be resampled to the rate.
    """
    spans = {channel.id: (traces[channel.id].start, traces[channel.id].end) for channel in channels}
    longest = max(end - start for start, end in spans.values())
    whole = [span for span in spans.values() if span[1] - span[0] >= SHARE_OF_SPAN * longest]
    start, end = max(span[0] for span in whole), min(span[1] for span in whole)
    count = int((end - start).total_seconds() * rate + SAME_INSTANT) + 1
    if end <= start:
        raise RecordError(f"the channels have no time in common: the last begins at {start}, the first ends at {end}")
    samples = np.full((len(channels), count), np.nan)
    for row, channel in zip(samples, channels, strict=True):
        _fill(row, traces[channel.id], start, rate)
    return Record(start=start, rate=rate, channels=tuple(channels), samples=samples)


def _too_long(segments: Sequence[Segment], rate: float) -> Finding | None:
    """Finding for segments that would not fit into memory on one time base."""
    if not segments:
        return None
    ends = [segment.start.timestamp() + segment.samples.size / segment.rate for segment in segments]
    seconds = max(ends) - min(segment.start.timestamp() for segment in segments)
    count = seconds * max(rate, *(segment.rate for segment in segments))
    if count <= MOST_SAMPLES:
        return None
    message = (
        f"the event lasts {seconds / 3600:.3g} h, {count:.3g} samples per channel; the limit is {MOST_SAMPLES:.3g}"
    )
    return Finding("record", "fatal", message)


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
    """Record of the traces that cover the whole event, and a finding for each of the others."""
    used = tuple(channel for channel in wanted if channel.id in traces)
    if not used:
        raise RecordError("no channel of the description can be used; see the other findings")
    record = on_one_time_base(traces, used, rate)
    whole = np.array([bool(np.isfinite(row).all()) for row in record.samples])
    if not whole.any():
        raise RecordError("no channel covers the whole event; send the missing data and analyse again")
    kept = tuple(channel for channel, complete in zip(used, whole, strict=True) if complete)
    rows = np.array([without_baseline(row, rate) for row in record.samples[whole]])
    return replace(record, channels=kept, samples=rows), _incomplete(record, description)


def _incomplete(record: Record, description: BuildingDescription) -> tuple[Finding, ...]:
    absent = np.sum(~np.isfinite(record.samples), axis=1) / record.rate
    return tuple(
        Finding(
            "gap",
            loss(channel, description),
            f"lacks {seconds:.3g} s of the event and is left out; send the missing data and analyse again",
            channel.id,
            float(seconds),
        )
        for channel, seconds in zip(record.channels, absent, strict=True)
        if seconds
    )


def _placed(segment: Segment, start: datetime) -> tuple[int, Vector]:
    """Index of the segment's first sample on the trace that begins at `start`, and its samples at those instants."""
    offset = (segment.start - start).total_seconds() * segment.rate
    index = round(offset)
    if abs(offset - index) <= SAME_INSTANT or not np.isfinite(segment.samples).all():
        return index, segment.samples
    index = int(np.ceil(offset))
    return index, resampled(segment.samples, segment.rate, segment.rate, (index - offset) / segment.rate)


def _overlap(channel: str, twice: int, contradicting: int, rate: float) -> tuple[Finding, ...]:
    if not twice:
        return ()
    if not contradicting:
        message = f"{twice} samples were sent twice and agree; each counts once"
        return (Finding("overlap", "note", message, channel, twice / rate),)
    message = (
        f"{contradicting} of {twice} samples that were sent twice differ; the earlier file counts. "
        "Check the logger's clock"
    )
    return (Finding("overlap", "warning", message, channel, twice / rate),)


def _fill(row: Vector, trace: Trace, start: datetime, rate: float) -> None:
    """Write the trace into the row of a record that begins at `start`."""
    if not np.isfinite(trace.samples).all():
        return
    delay = (start - trace.start).total_seconds()
    first = max(0, int(np.ceil(-delay * rate - SAME_INSTANT)))
    values = resampled(trace.samples, trace.rate, rate, max(0.0, delay + first / rate))[: max(0, row.size - first)]
    row[first : first + values.size] = values
