"""Segments of many channels, rates and start times, brought onto one time base."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from core.arrays import Vector
from core.errors import RecordError
from core.quality import Finding
from core.record import Channel, Record, Segment
from core.signals.conditioning import SAME_INSTANT, resampled

SAME_VALUE = 1e-6
"""Of the channel's largest value: two records of one sample that differ by less are the same."""
SHARE_OF_SPAN = 0.9
"""A channel that covers less than this share of the longest does not shorten the others' time base."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """All of one channel at its own rate."""

    start: datetime
    """Time of the first sample, aware."""
    rate: float
    """Hz."""
    samples: Vector
    """(n,) SI units; NaN where nothing was recorded."""

    @property
    def end(self) -> datetime:
        """Time of the last sample."""
        return self.start + timedelta(seconds=(self.samples.size - 1) / self.rate)


def joined(segments: Sequence[Segment]) -> tuple[Trace, tuple[Finding, ...]]:
    """One channel's segments as one trace, with what was found where they overlap.

    A segment that begins between two samples of the first one is moved onto its instants. Where two segments
    overlap and contradict each other, the earlier one counts.

    Raises:
        RecordError: no segment has a sample, the rates differ, or a start has no time zone.
    """
    pieces = sorted((s for s in segments if s.samples.size), key=lambda segment: (segment.start, -segment.samples.size))
    if not pieces:
        raise RecordError("holds no samples; a file with samples would do")
    if any(piece.start.tzinfo is None for piece in pieces):
        raise RecordError("starts at a time without time zone; UTC would do")
    rate = pieces[0].rate
    if not rate > 0 or any(abs(piece.rate / rate - 1) > 1e-5 for piece in pieces):
        raise RecordError(f"has rates {sorted({piece.rate for piece in pieces})} Hz; one rate above 0 Hz would do")
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

    Channels that cover less than 90 % of the longest do not shorten the others' time: they end in NaN, as do those
    with NaN inside, which a filter would spread: such a channel is wholly NaN.

    Args:
        traces: by channel id.
        channels: those of the record, in order; each has a trace.
        rate: Hz.

    Raises:
        RecordError: the channels have no time in common, or a rate cannot be brought to the one wanted.
    """
    spans = {channel.id: (traces[channel.id].start, traces[channel.id].end) for channel in channels}
    longest = max(end - start for start, end in spans.values())
    whole = [span for span in spans.values() if span[1] - span[0] >= SHARE_OF_SPAN * longest]
    start, end = max(span[0] for span in whole), min(span[1] for span in whole)
    count = int((end - start).total_seconds() * rate + SAME_INSTANT) + 1
    if end <= start:
        raise RecordError(f"the channels have no time in common: the last begins {start}, the first ends {end}")
    samples = np.full((len(channels), count), np.nan)
    for row, channel in zip(samples, channels, strict=True):
        _fill(row, traces[channel.id], start, rate)
    return Record(start=start, rate=rate, channels=tuple(channels), samples=samples)


def _placed(segment: Segment, start: datetime) -> tuple[int, Vector]:
    """Index of the segment's first sample on the trace that begins at `start`, and its samples on those instants."""
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
        f"{contradicting} of {twice} samples that were sent twice contradict each other; the earlier file counts. "
        "Check the logger's clock"
    )
    return (Finding("overlap", "warning", message, channel, twice / rate),)


def _fill(row: Vector, trace: Trace, start: datetime, rate: float) -> None:
    """Writes the trace into the row of a record that begins at `start`."""
    if not np.isfinite(trace.samples).all():
        return
    delay = (start - trace.start).total_seconds()
    first = max(0, int(np.ceil(-delay * rate - SAME_INSTANT)))
    values = resampled(trace.samples, trace.rate, rate, max(0.0, delay + first / rate))[: max(0, row.size - first)]
    row[first : first + values.size] = values
