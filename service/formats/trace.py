"""Traces, the common form of all formats, with the selection and checks of a building's; the contents of a file."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from math import ceil, floor
from typing import Literal, TypeVar

import numpy as np

from core.arrays import Vector
from core.record import Channel, Quantity, Segment
from service.formats.format_errors import FormatError
from service.formats.units import Gain

Numbers = np.ndarray[tuple[int], np.dtype[np.int32 | np.float32 | np.float64]]
Span = tuple[datetime, datetime]
"""First and last time, aware."""
Piece = TypeVar("Piece")
ROUNDING = 0.01
"""Samples: times are rounded to microseconds, and a sample at the border must not be lost by that."""
SI: Mapping[Quantity, str] = {"acceleration": "m/s²", "velocity": "m/s", "displacement": "m", "temperature": "°C"}
LARGEST: Mapping[Quantity, float] = {"acceleration": 50.0, "velocity": 20.0, "displacement": 10.0, "temperature": 200.0}
"""SI: beyond any building's motion; if a tenth of the samples exceed it, the unit is wrong."""
RATES: Mapping[Quantity, tuple[float, float]] = {
    "acceleration": (10.0, 2000.0),
    "velocity": (10.0, 2000.0),
    "displacement": (10.0, 2000.0),
    "temperature": (1e-4, 2000.0),
}
"""Hz, lowest and highest. An isolated building answers between 0.2 and 30 Hz, and its loggers sample at 50 to 500 Hz.

Below 10 Hz the loops of its isolators are lost; no logger of structures is faster than 2000 Hz.
Temperatures may be far apart.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """An unbroken piece of one channel, in the file's own numbers, and what they mean."""

    channel: str
    """Network, station, location and channel code, made for each format as docs/operate/formats.md describes."""
    start: datetime
    """Time of the first sample, UTC."""
    rate: float
    """Hz."""
    numbers: Numbers
    """(n,) as stored; int32, float32 or float64."""
    gain: float
    """SI units per number."""
    quantity: Quantity
    sensor: str = ""
    """The sensor's place and orientation, in the file's words."""

    def __post_init__(self) -> None:
        if self.numbers.dtype not in (np.int32, np.float32, np.float64):
            raise FormatError(f"samples of {self.channel} are {self.numbers.dtype}; use integers or floats")
        if not self.rate > 0:
            raise FormatError(f"the sampling rate of {self.channel} is {self.rate} Hz; it must be above 0")
        finite = np.isfinite(self.numbers)
        if not finite.all():
            raise FormatError(
                f"{np.count_nonzero(~finite)} of {finite.size} samples of {self.channel} are not numbers, the first "
                f"at sample {np.argmin(finite) + 1}; where nothing was recorded the file must have a gap"
            )

    @property
    def span(self) -> Span:
        """Times of the first and of the last sample."""
        return self.start, self.start + timedelta(seconds=(self.numbers.size - 1) / self.rate)

    def cut(self, start: datetime, end: datetime) -> "Trace | None":
        """The samples from `start` to `end`, both included; None if there are none."""
        first = max(0, ceil((start - self.start).total_seconds() * self.rate - ROUNDING))
        last = min(self.numbers.size - 1, floor((end - self.start).total_seconds() * self.rate + ROUNDING))
        if first > last:
            return None
        begun = self.start + timedelta(seconds=first / self.rate)
        return replace(self, start=begun, numbers=self.numbers[first : last + 1])

    def to_si(self) -> Vector:
        """(n,) samples in SI units."""
        return self.numbers.astype(np.float64) * self.gain

    def segment(self) -> Segment:
        """The trace in SI units, as core takes it."""
        return Segment(self.channel, self.start, self.rate, self.to_si())


def overlapping(
    pieces: Iterable[Piece], span: Callable[[Piece], Span], slack: timedelta = timedelta(0)
) -> tuple[tuple[Piece, ...], ...]:
    """Groups of pieces whose times overlap, directly or through others: each group belongs to one earthquake.

    Args:
        pieces: anything with a beginning and an end.
        span: gives the first and last time of a piece.
        slack: pieces this far apart still belong together, for loggers that cut their files.

    Returns:
        The groups, earliest first, each in order of time.
    """
    groups: list[list[Piece]] = []
    latest: datetime | None = None
    for piece in sorted(pieces, key=span):
        start, end = span(piece)
        if latest is None or start > latest + slack:
            groups.append([])
            latest = end
        groups[-1].append(piece)
        latest = max(latest, end)
    return tuple(tuple(group) for group in groups)


def extent(traces: Iterable[Trace]) -> Span:
    """From the first sample of all traces to the last."""
    spans = [trace.span for trace in traces]
    return min(start for start, _ in spans), max(end for _, end in spans)


@dataclass(frozen=True, slots=True)
class Contents:
    """The contents of a file."""

    kind: Literal["waveforms", "station"]
    """`station`: gains only."""
    traces: tuple[Trace, ...] = ()
    gains: Mapping[str, Gain] = field(default_factory=dict)
    """By channel id, from StationXML."""
    without_unit: tuple[str, ...] = ()
    """Ids of channels that are not in `traces` because the unit of their numbers is not known yet."""
    remarks: tuple[str, ...] = ()
    """Other omissions, with reasons."""


def of_building(traces: Iterable[Trace], channels: Sequence[Channel]) -> tuple[Trace, ...]:
    """The traces of the building's channels.

    Raises:
        FormatError: none is the building's, or one has another quantity, an impossible rate or impossible values.
    """
    known = {channel.id: channel for channel in channels}
    every = tuple(traces)
    kept = tuple(trace for trace in every if trace.channel in known)
    if every and not kept:
        strangers = ", ".join(dict.fromkeys(trace.channel for trace in every))
        raise FormatError(f"no channel of this building: found {strangers}; the building has {', '.join(known)}")
    for trace in kept:
        _check(trace, known[trace.channel])
    return kept


def _range(numbers: Numbers) -> float:
    """Largest number less the smallest."""
    return float(numbers.max()) - float(numbers.min()) if numbers.size else 0.0


def _check(trace: Trace, channel: Channel) -> None:
    if trace.quantity != channel.quantity:
        raise FormatError(
            f"{channel.id} measures {channel.quantity} according to the building file, but the unit of its records is "
            f"one of {trace.quantity}; correct one of the two"
        )
    lowest, highest = RATES[trace.quantity]
    if not lowest <= trace.rate <= highest:
        raise FormatError(
            f"{channel.id} has {trace.rate:g} samples a second; {lowest:g} to {highest:g} Hz are accepted for "
            f"{trace.quantity}, so the sampling rate of its records must be wrong"
        )
    if _range(trace.numbers) * abs(trace.gain) <= LARGEST[trace.quantity]:
        return  # no sample is further from the median than the largest is from the smallest
    samples = trace.to_si()
    usual = float(np.quantile(np.abs(samples - np.median(samples)), 0.9))
    if usual > LARGEST[trace.quantity]:
        raise FormatError(
            f"a tenth of the samples of {channel.id} lie more than {usual:.3g} {SI[trace.quantity]} from their median, "
            f"which no building does; the unit or the gain of its records must be wrong"
        )
