"""Gaps that a recorder filled: it wrote its last value again, zeros, or a straight line to the next sample.

A channel that moves before and after such a stretch does not rest exactly within it. What looks alike is left: a motion
coarser than the digitiser's step, a sensor at its limit, the record's ends, a layer that sticks between two slips.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from core.arrays import Mask, Vector
from core.record import Quantity, Trace

FEWEST_EQUAL = 5
"""Successive equal samples of a filled gap at least. A choice."""
FEWEST_STRAIGHT = 7
"""The same of samples on a straight line. A choice."""
BESIDE = 1.0
"""s, of the motion on either side that a stretch is compared with. A choice."""
SEEN = 3.0
"""Steps of the digitiser between the samples of a motion that is to be seen to leave its rest by a jump. A choice."""
FINE = 30.0
"""Steps of the digitiser between the samples of a finely resolved motion, in the median. So many samples are equal by
chance once in 10⁸ times."""
BREAK = 5.0
"""Change at the end of a gap, in steps of the digitiser, or for a motion that may stick in medians of the changes."""
ROUNDING = 1e-7
"""Differences, over the channel's largest, that are none: those of numbers of 32 bits."""
LIMIT = 1e-3
"""Share of the range within which a value is the channel's largest or smallest: the sensor may be at its limit."""
RESTLESS: Mapping[Quantity, float] = MappingProxyType(
    {"acceleration": FINE, "velocity": np.inf, "displacement": np.inf}
)
"""Steps between samples from which on equal samples, or a straight line, alone show a gap, by quantity.

A layer that sticks rests exactly, and so does its displacement, which is also smooth; it does not leave its rest by a
jump."""


@dataclass(frozen=True, slots=True)
class FilledGap:
    """Samples that were not measured."""

    first: int
    stop: int
    kind: str
    """The recorder's way of filling it, in words."""


LAST_VALUE, ZEROS, LINE = "its last value", "zeros", "a straight line"
"""Values that a recorder writes in place of samples it lost."""


def filled_gaps(trace: Trace, quantity: Quantity) -> tuple[FilledGap, ...]:
    """Gaps within a motion that the recorder filled, in order.

    Args:
        trace: as it was recorded; NaN where nothing was.
        quantity: measured by the channel.
    """
    if quantity == "temperature":
        return ()
    samples = trace.samples
    changes = np.abs(np.diff(samples))
    moved = changes[np.isfinite(changes) & (changes > 0)]
    if samples.size < FEWEST_STRAIGHT or not moved.size:
        return ()
    least = ROUNDING * float(np.nanmax(np.abs(samples)))
    step = max(float(moved.min()), least)
    bends = np.abs(np.diff(samples, 2))
    near = max(FEWEST_EQUAL, round(BESIDE * trace.rate))
    free = _free(samples)
    equal = [(a, b + 1) for a, b in _runs(changes <= least) if b + 1 - a >= FEWEST_EQUAL]
    found = [
        FilledGap(*_inside(samples, a, b), ZEROS if samples[a] == 0 else LAST_VALUE)
        for a, b in equal
        if free[a] and _is_held(changes, (a, b), step, near, RESTLESS[quantity])
    ]
    straight = [(a, b + 2) for a, b in _runs(bends <= 1.01 * step) if b + 2 - a >= FEWEST_STRAIGHT]
    found += [
        FilledGap(a + 1, b - 1, LINE)
        for a, b in straight
        if changes[a] > least and _is_line(bends, (a, b), step, near, RESTLESS[quantity])
    ]
    return tuple(sorted(found, key=lambda one: one.first))


def without_fill(trace: Trace, gaps: tuple[FilledGap, ...]) -> Trace:
    """The trace with NaN in place of samples that were not measured."""
    samples = trace.samples.copy()
    for one in gaps:
        samples[one.first : one.stop] = np.nan
    return Trace(trace.start, trace.rate, samples)


def _runs(there: Mask) -> list[tuple[int, int]]:
    """First index of each stretch, and one past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _inside(samples: Vector, first: int, stop: int) -> tuple[int, int]:
    """The stretch without the sample that was measured before its value was repeated."""
    return (first, stop) if samples[first] == 0 else (first + 1, stop)


def _median(values: Vector, first: int, stop: int) -> float:
    """Median of the finite values in [first, stop); 0 without any."""
    near = values[max(first, 0) : max(stop, 0)]
    near = near[np.isfinite(near)]
    return float(np.median(near)) if near.size else 0.0


def _free(samples: Vector) -> Mask:
    """(n,) True away from the channel's largest and smallest values, where a sensor may be at its limit; zeros are."""
    low, high = float(np.nanmin(samples)), float(np.nanmax(samples))
    margin = LIMIT * (high - low)
    return np.asarray((samples == 0) | ((samples > low + margin) & (samples < high - margin)))


def _is_held(changes: Vector, run: tuple[int, int], step: float, near: int, fine: float) -> bool:
    """True if equal samples within a motion cannot have been measured."""
    first, stop = run
    if first < near or stop > changes.size + 1 - near:
        return False
    sides = [_median(changes, first - near, first - 1), _median(changes, stop, stop + near)]
    largest = max((float(one) for one in (changes[first - 1], changes[stop - 1]) if np.isfinite(one)), default=0.0)
    is_fine = min(sides) > fine * step and largest > BREAK * step
    return is_fine or (min(sides) >= SEEN * step and largest > BREAK * max(sides))


def _is_line(bends: Vector, run: tuple[int, int], step: float, near: int, fine: float) -> bool:
    """True if samples on a straight line within a motion cannot have been measured."""
    first, stop = run
    if first < near or stop > bends.size + 2 - near:
        return False
    sides = [_median(bends, first - near, first - 1), _median(bends, stop, stop + near)]
    ends = max(float(bends[first - 1]), float(bends[stop - 2]))
    return min(sides) > fine * step and ends > 2 * BREAK * step
