"""Earthquakes in a continuous record, detected by STA/LTA on several channels together.

Allen (1978), Bull. Seism. Soc. Am. 68, 1521; the ratio and the coincidence are ObsPy's.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from core.record import Segment
from service.formats import FormatError, Trace as Recorded
from service.formats.trace import Span, overlapping

if TYPE_CHECKING:  # it takes long to import, and is imported where records are continuous
    from obspy import Stream, Trace, UTCDateTime

LOWEST = 0.5
"""Hz, of the high-pass filter before the ratio: an offset or a drift would hide the shaking."""
LONGEST_GAP = timedelta(hours=6)
"""The ratio begins anew behind a longer one."""
MOST_SAMPLES = 200_000_000
"""Largest number, over all channels of one file with its gaps filled."""
MEDIAN_TO_RMS = 1.4826
"""Ratio for Gaussian noise; an earthquake in less than half of the record changes the median little."""


@dataclass(frozen=True, slots=True)
class TriggerSettings:
    """Conditions under which shaking is an earthquake, and the margins kept around it."""

    short: float
    """s, short-term window."""
    long: float
    """s, long-term window: nothing triggers before one has been recorded; later gaps do not matter."""
    on: float
    """Ratio that begins an event."""
    off: float
    """Ratio that ends it."""
    channels: int
    """Number that must trigger together; all, if the building has fewer."""
    floor: float
    """m/s², peak below which nothing is an event."""
    before: timedelta
    after: timedelta


@dataclass(frozen=True, slots=True)
class Window:
    """The time of one earthquake, with its margins before and after."""

    start: datetime
    end: datetime


def check_gaps(traces: Sequence[Recorded]) -> None:
    """Reject records so far apart that they would not fit into memory with their gaps filled.

    Raises:
        FormatError: they do not; the message gives the number of samples.
    """
    count = 0.0
    for group in overlapping(traces, lambda trace: trace.span, LONGEST_GAP):
        start, end = min(trace.start for trace in group), max(trace.span[1] for trace in group)
        rates = {(trace.channel, trace.rate) for trace in group}
        count += (end - start).total_seconds() * sum(rate for _, rate in rates)
    if count > MOST_SAMPLES:
        raise FormatError(
            f"with its gaps filled the record would have {count:.3g} samples, at most {MOST_SAMPLES:.3g} are accepted; "
            f"send shorter files"
        )


def windows(segments: Sequence[Segment], settings: TriggerSettings) -> tuple[Window, ...]:
    """The earthquakes in continuous records, earliest first; windows that touch are one.

    Args:
        segments: accelerations, SI, any number of pieces a channel; pieces may overlap.
        settings: of the trigger.
    """
    groups = overlapping(segments, _span, LONGEST_GAP)
    return _joined([window for group in groups for window in _windows(group, settings)])


def _windows(segments: Sequence[Segment], settings: TriggerSettings) -> Sequence[Window]:
    """The earthquakes in records without long gaps."""
    from obspy.signal.trigger import coincidence_trigger

    stream = _stream(segments, settings)
    if not stream:
        return ()
    wanted = min(settings.channels, len({trace.id for trace in stream}))
    triggers = coincidence_trigger(
        "recstalta", settings.on, settings.off, stream, wanted, sta=settings.short, lta=settings.long
    )
    windows = []
    for trigger in triggers:
        start, end = trigger["time"], trigger["time"] + trigger["duration"]
        if _peak(stream, start, end) >= settings.floor:
            windows.append(Window(_aware(start) - settings.before, _aware(end) + settings.after))
    return windows


def _span(segment: Segment) -> Span:
    return segment.start, segment.start + timedelta(seconds=segment.samples.size / segment.rate)


def _stream(segments: Sequence[Segment], settings: TriggerSettings) -> "Stream":
    """One trace a channel and rate, of those long enough for the ratio."""
    from obspy import Stream

    of_channels: dict[tuple[str, float], list[Segment]] = defaultdict(list)
    for segment in segments:
        of_channels[segment.channel, segment.rate].append(segment)
    bridged = (_bridged(pieces) for pieces in of_channels.values())
    return Stream(trace for trace in bridged if trace.stats.endtime - trace.stats.starttime > settings.long)


def _bridged(segments: Sequence[Segment]) -> "Trace":
    """A channel's pieces without their offset, one trace over all gaps.

    A gap is filled with the level of the noise: the ratio neither sees an earthquake there nor begins anew behind it.
    """
    from obspy import Stream

    pieces = Stream(_trace(segment) for segment in segments).merge(method=1, interpolation_samples=0).split()
    pieces.detrend("constant").filter("highpass", freq=LOWEST)
    level = MEDIAN_TO_RMS * float(np.median(np.abs(np.concatenate([piece.data for piece in pieces]))))
    return pieces.merge(method=1, fill_value=level)[0]


def _trace(segment: Segment) -> "Trace":
    from obspy import Trace, UTCDateTime

    codes = zip(("network", "station", "location", "channel"), segment.channel.split("."), strict=True)
    header: dict[str, object] = dict(codes)
    header |= {"starttime": UTCDateTime(segment.start), "sampling_rate": segment.rate}
    return Trace(segment.samples.copy(), header)


def _peak(stream: "Stream", start: "UTCDateTime", end: "UTCDateTime") -> float:
    pieces = stream.slice(start, end)
    return max((float(np.abs(trace.data).max()) for trace in pieces if trace.stats.npts), default=0.0)


def _joined(windows: Sequence[Window]) -> tuple[Window, ...]:
    joined: list[Window] = []
    for window in sorted(windows, key=lambda window: window.start):
        if joined and window.start <= joined[-1].end:
            joined[-1] = Window(joined[-1].start, max(joined[-1].end, window.end))
        else:
            joined.append(window)
    return tuple(joined)


def _aware(time: "UTCDateTime") -> datetime:
    moment: datetime = time.datetime
    return moment.replace(tzinfo=UTC)
