"""Resting level of a channel: its offset from zero, jumps of an acceleration, and baseline drift.

An acceleration always rests at one level. A layer stays where an earthquake leaves it: the level of its displacement is
constant before the motion and, once it has crept to rest, after it, though the two may differ. A sensor whose level
changes otherwise jumps or drifts.

The record is divided into blocks; the mean of each estimates the level, with an uncertainty from its motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
import scipy
from numpy.polynomial import Polynomial

from core.arrays import Mask, Matrix, Vector
from core.errors import RecordError
from core.record import Channel, Finding, Quantity, Trace
from core.signals.conditioning import position_at_rest
from core.signals.noise import noise_std

NOTABLE: Mapping[Quantity, float] = {"acceleration": 0.01, "velocity": 0.01, "displacement": 0.001}
"""SI units, offset from zero that is noted: 1 gal, 1 cm/s, 1 mm. Not tuned."""
SHARE_OF_PEAK = 0.5
"""Offset over the largest motion that is noted too, for weak records. Not tuned."""
SMALLEST_JUMP = 0.005
"""m/s² (0.5 gal), jump of an acceleration's level below which no estimate is affected. Not tuned."""
BLOCK = 5.0
"""s, duration of a block. A choice: two periods of a usual isolation layer."""
SWAY = 0.2
"""Uncertainty of a level over the block's standard deviation: the mean of 5 s of motion at 0.5 Hz is at most
√2 / (5 · 0.5 π) of it."""
FEWEST_BLOCKS = 4
"""Blocks of a record whose jumps are searched for. Not tuned."""
RELATIVE_RESOLUTION = 1e-4
"""Uncertainty of a level over the record's largest value, at least, in the search for jumps. A choice: 80 dB."""
CERTAIN_JUMP = 8.0
"""Standard deviations by which the levels before and after a jump must differ. A choice: the best of all instants is
tested, and motion is not normal."""
RESOLUTION = 1e-5
"""m or m/s², uncertainty of a level at least, in the search for drift: the resolution of a good sensor."""
QUIET = 0.1
"""Standard deviation over that of the strongest block below which a block is at rest. Not tuned.

A weaker limit than core.signals.conditioning.AT_REST: motion that is left here enlarges the level's uncertainty."""
SLOWEST_MOTION = 0.05
"""Hz, lowest frequency of the motion that accelerations determine: a half cycle in two blocks. A choice."""
NEAR_NOISE = 1.5
"""Standard deviation of an acceleration over that of its noise up to which nothing moves: the first waves of an
earthquake, longer than a block, displace a layer while hardly anything else is seen of them. A choice."""
WANDER = 0.7
"""Standard deviation by which a layer comes to lie elsewhere in the time of a block, over that of its motion. Chosen on
even seeds of benchmarks.diagnosis: with 0.5, 0.7 and 1 the same drifts are found."""
SETTLING = 0.6
"""Change of level in the second half of the rest after the motion over that in the first, up to which the layer comes
to rest: it creeps. Chosen on even seeds of benchmarks.diagnosis."""
CERTAIN_CHANGE = 4.0
"""Standard deviations that the change in the second half must be of. A choice."""
LIKELY_CHANGE = 1.5
"""The same where several records may show it together. Chosen on even seeds of benchmarks.diagnosis: of trials without
a drift, one record of five reached it at most."""
SLOWEST, FASTEST = 3, 5
"""Least degree of the polynomial that a transducer's drift is removed with, for the levels and slopes before and after
the motion; and the largest, if the levels support it."""


def without_jump(trace: Trace, channel: Channel) -> tuple[Trace, tuple[Finding, ...]]:
    """The trace at one resting level; a note if that is far from zero, a warning if an acceleration's level jumped.

    The residual offset of a displacement remains.

    Args:
        trace: of the channel without NaN, at its own rate.
        channel: its description.
    """
    level, jump = trace, None
    if channel.quantity == "acceleration":
        level, jump = _levelled(trace, channel)
    far = _far_from_zero(level, channel) if channel.quantity != "temperature" else None
    return level, tuple(finding for finding in (far, jump) if finding is not None)


def _far_from_zero(trace: Trace, channel: Channel) -> Finding | None:
    rest = position_at_rest(trace.samples, trace.rate)
    if abs(rest) < min(NOTABLE[channel.quantity], SHARE_OF_PEAK * float(np.abs(trace.samples - rest).max())):
        return None
    message = f"rests at {_with_unit(rest, channel.quantity)} instead of 0; the offset was removed"
    return Finding("offset", "note", message, channel.id, rest)


def _levelled(trace: Trace, channel: Channel) -> tuple[Trace, Finding | None]:
    step, block = _step(trace)
    if abs(step) < SMALLEST_JUMP:
        return trace, None
    at = _instant(trace, step, block)
    message = (
        f"its resting level jumped by {_with_unit(step, channel.quantity)} {at / trace.rate:.3g} s after its start; "
        "the jump was removed. Check the sensor's fixing and cable"
    )
    samples = trace.samples - np.where(np.arange(trace.samples.size) < at, 0.0, step)
    return Trace(trace.start, trace.rate, samples), Finding("offset", "warning", message, channel.id, step)


def _step(trace: Trace) -> tuple[float, int]:
    """The step that explains the levels of the record's blocks best, 0 if it is not certain; and its first block."""
    blocks = _blocks(trace.samples, trace.rate)
    if blocks.shape[0] < FEWEST_BLOCKS:
        return 0.0, 0
    levels, precision = blocks.mean(axis=1), _precision(blocks)
    weight, total = np.cumsum(precision), np.cumsum(precision * levels)
    before, after = weight[:-1], weight[-1] - weight[:-1]
    steps = (total[-1] - total[:-1]) / after - total[:-1] / before
    certainty = np.abs(steps) * np.sqrt(before * after / (before + after))
    block = int(np.argmax(certainty))
    return (float(steps[block]), block + 1) if certainty[block] > CERTAIN_JUMP else (0.0, 0)


def _instant(trace: Trace, step: float, block: int) -> int:
    """Sample at which the level jumps: the turning point of the cumulative sum about the two levels' mean (Page
    1954)."""
    length = _block_length(trace.rate)
    start = (block - 1) * length
    near = trace.samples[start : start + 2 * length]
    middle = np.mean(trace.samples[start - length : start] if start else near[:length]) + step / 2
    return start + int(np.argmin(np.cumsum(np.sign(step) * (near - middle)))) + 1


def _precision(blocks: Matrix) -> Vector:
    """(blocks,) 1 / variance of each block's mean as an estimate of the resting level."""
    deviation = SWAY * blocks.std(axis=1) + RELATIVE_RESOLUTION * np.abs(blocks - np.median(blocks)).max()
    return np.asarray(1 / np.maximum(deviation, np.finfo(float).tiny ** 0.25) ** 2)


def _block_length(rate: float) -> int:
    return max(1, round(BLOCK * rate))


def _blocks(samples: Vector, rate: float) -> Matrix:
    """(blocks, samples) successive blocks; the remainder is dropped."""
    length = _block_length(rate)
    return samples[: samples.size // length * length].reshape(-1, length)


def _with_unit(value: float, quantity: Quantity) -> str:
    if quantity == "acceleration":
        return f"{value:.3g} m/s² ({100 * value:.3g} gal)"
    if quantity == "displacement":
        return f"{value:.3g} m ({1000 * value:.3g} mm)"
    return f"{value:.3g} m/s ({100 * value:.3g} cm/s)"


@dataclass(frozen=True, slots=True)
class BaselineDrift:
    """Difference between two levels within one stretch at rest."""

    change: float
    """m or m/s², from the earlier to the later."""
    std: float
    """In the same unit."""
    share: float
    """Absolute change over the record's largest absolute value."""

    @property
    def certainty(self) -> float:
        """Standard deviations that the change is of."""
        return abs(self.change) / self.std


def baseline_drift(samples: Vector, rate: float) -> BaselineDrift | None:
    """Change of an accelerometer's level while the building is at rest; None without two successive blocks at rest.

    Args:
        samples: (n,) m/s².
        rate: Hz.
    """
    known = _levels(samples, rate)
    return max(_changes(samples, known, _runs(known.quiet)), key=lambda one: one.certainty, default=None)


def transducer_drift(samples: Vector, rate: float, relative: Vector | None = None) -> BaselineDrift | None:
    """Change of a transducer's level that no motion of the layer makes; None if the record cannot show any.

    A layer with friction or rubber that relaxes creeps: the level changes after the motion and ever more slowly. A
    transducer that drifts does so before the motion too, and does not settle after it. Of the changes that are certain
    the largest is returned; without any, the one that is most likely: several records may show it together.

    As long as it moves, a layer that yields may come to lie elsewhere by as much: the level wanders. That is the
    uncertainty of a change between two blocks, beside that of their levels. It vanishes where the accelerations are
    hardly more than their noise. Elsewhere, oscillation within a block is motion, and a slope is motion as far as the
    accelerations of both sides, integrated twice, confirm it.

    Args:
        samples: (n,) m, across the layer.
        rate: Hz.
        relative: (n,) m/s², acceleration above the layer less that below it; without it, every slope may be motion.
    """
    levels = _levels(samples, rate)
    still = levels.quiet if relative is None else levels.quiet & _near_noise(relative, rate)
    known = _wandering(levels, samples, rate, relative, still)
    runs = _runs(known.quiet)
    before = [run for run in _runs(still) if run[0] == 0 and run[1] > 1]
    after = [run for run in runs if run[0] > 0 and run[1] == known.quiet.size and run[1] - run[0] > 2]
    if not after and not before:
        return None
    drifting = [run for run in after if not _settles(known, *run, CERTAIN_CHANGE)]
    likely = [run for run in after if not _settles(known, *run, LIKELY_CHANGE)]
    changes = [BaselineDrift(0.0, RESOLUTION, 0.0), *_changes(samples, known, [*before, *drifting])]
    changes += [_drift(samples, *_change(known, (first + end - 1) // 2, end - 1)) for first, end in likely]
    return max(changes, key=lambda one: (min(one.certainty, CERTAIN_CHANGE), one.share))


def without_drift(samples: Vector, rate: float) -> Vector:
    """A transducer's samples less the polynomial through their levels, which count by how near to rest they are.

    The residual offset of the layer is removed with it.

    Args:
        samples: (n,) m, across the layer.
        rate: Hz.
    """
    known = _levels(samples, rate)
    count = known.level.size
    if count <= SLOWEST:
        return samples
    place = (np.arange(count) + 0.5) * _block_length(rate) / samples.size
    degrees = [degree for degree in range(SLOWEST, FASTEST + 1) if count > degree + 3] or [SLOWEST]
    level = _windowed_levels(samples, rate)
    shapes = [Polynomial.fit(place, level, degree, domain=[0, 1], w=1 / known.std) for degree in degrees]
    left = [(level - one(place)) / known.std for one in shapes]
    best = min(range(len(shapes)), key=lambda n: _criterion(left[n], degrees[n])) if len(shapes) > 1 else 0
    return np.asarray(samples - shapes[best](np.arange(samples.size) / samples.size))


def _windowed_levels(samples: Vector, rate: float) -> Vector:
    """(blocks,) levels in the middle of blocks: of straight lines through twice their length, by Hann's window. They
    hold far less of the layer's motion than the means of blocks do."""
    length = _block_length(rate)
    window, time = np.hanning(2 * length + 1)[:-1], np.arange(-length, length)
    levels = np.empty(samples.size // length)
    for block in range(levels.size):
        at = block * length + length // 2 + time
        here = (at >= 0) & (at < samples.size)
        levels[block] = np.polynomial.polynomial.polyfit(time[here], samples[at[here]], 1, w=np.sqrt(window[here]))[0]
    return levels


def _criterion(left: Vector, degree: int) -> float:
    """Akaike's criterion, corrected for few values (Hurvich & Tsai 1989), of a polynomial that leaves these values over
    their standard deviations. Those are upper bounds: their scale is fitted too."""
    count, free = left.size, degree + 2
    power = float(np.mean(left**2)) + np.finfo(float).tiny
    return count * float(np.log(power)) + 2 * free * count / (count - free - 1)


@dataclass(frozen=True, slots=True, eq=False)
class _Levels:
    """Levels of a record's blocks."""

    level: Vector
    """(blocks,) m or m/s²."""
    std: Vector
    """(blocks,) in the same unit."""
    quiet: Mask
    """(blocks,) True where the building is at rest."""
    wander: Vector | None = None
    """(blocks,) standard deviation by which a layer that moves may come to lie elsewhere until the middle of each
    block, in the same unit; None where the level is one and the same, as an acceleration's."""


def _levels(samples: Vector, rate: float) -> _Levels:
    blocks = _blocks(samples, rate)
    moving = _std_about_trend(blocks)
    return _Levels(blocks.mean(axis=1), SWAY * moving + RESOLUTION, moving < QUIET * moving.max(initial=0.0))


def _wandering(levels: _Levels, samples: Vector, rate: float, relative: Vector | None, still: Mask) -> _Levels:
    """The levels of a layer that wanders while it moves, from block to block independently."""
    blocks = _blocks(samples, rate)
    power = _std_about_trend(blocks) ** 2
    slope = blocks.var(axis=1) - power
    if relative is not None:
        power = np.where(still, 0.0, power)
        moved = _blocks(_integral(relative, rate), rate)
        slope = np.where(still, 0.0, np.minimum(slope, moved.var(axis=1) - _std_about_trend(moved) ** 2))
    power = WANDER**2 * (power + np.maximum(slope, 0.0))
    return replace(levels, wander=np.sqrt(np.cumsum(power) - power / 2))


def _near_noise(relative: Vector, rate: float) -> Mask:
    """(blocks,) True where an acceleration is hardly more than noise; nowhere if the record is too short to tell."""
    blocks = _blocks(relative, rate)
    try:
        (noise,) = noise_std(relative[None], rate)
    except RecordError:
        return np.zeros(len(blocks), dtype=bool)
    return np.asarray(blocks.std(axis=1) < NEAR_NOISE * noise)


def _integral(relative: Vector, rate: float) -> Vector:
    """(n,) m, displacement across the layer above SLOWEST_MOTION by its relative acceleration in m/s²."""
    sections = scipy.signal.butter(2, SLOWEST_MOTION, "high", fs=rate, output="sos")
    moved = relative - relative.mean()
    for _ in range(2):
        moved = scipy.signal.sosfilt(sections, scipy.integrate.cumulative_trapezoid(moved, dx=1 / rate, initial=0.0))
    return np.asarray(moved)


def _changes(samples: Vector, known: _Levels, runs: Sequence[tuple[int, int]]) -> list[BaselineDrift]:
    """The changes between any two blocks of these stretches at rest."""
    return [
        _drift(samples, *_change(known, earlier, later))
        for first, end in runs
        for earlier, later in combinations(range(first, end), 2)
    ]


def _drift(samples: Vector, change: float, std: float) -> BaselineDrift:
    return BaselineDrift(change, std, abs(change) / float(np.abs(samples).max()))


def _change(known: _Levels, earlier: int, later: int) -> tuple[float, float]:
    """Change of level between two blocks, and its standard deviation."""
    change = float(known.level[later] - known.level[earlier])
    variance = known.std[earlier] ** 2 + known.std[later] ** 2
    if known.wander is not None:
        variance += known.wander[later] ** 2 - known.wander[earlier] ** 2
    return change, float(np.sqrt(variance))


def _settles(known: _Levels, first: int, end: int, certain: float) -> bool:
    """True if the level in [first, end) changes ever more slowly, or by less than so many standard deviations in the
    second half."""
    middle = (first + end - 1) // 2
    (early, _), (late, error) = _change(known, first, middle), _change(known, middle, end - 1)
    return abs(late) < certain * error or (late * early > 0 and abs(late) < SETTLING * abs(early))


def _std_about_trend(blocks: Matrix) -> Vector:
    """(blocks,) standard deviation of each about its straight line."""
    time = np.linspace(-1.0, 1.0, blocks.shape[1])
    centred = blocks - blocks.mean(axis=1, keepdims=True)
    return np.asarray((centred - np.outer(centred @ time / (time @ time), time)).std(axis=1))


def _runs(quiet: Mask) -> list[tuple[int, int]]:
    """First block of each stretch at rest, and one past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]])))
    return [(int(first), int(end)) for first, end in list(pairwise(edges))[::2]]
