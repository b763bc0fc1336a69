"""Damage within one event: the cycles after its largest against those before it, at matched amplitude.

Each cycle is compared with the baseline at its own amplitude, which removes the effect of the curve. Healthy layers
soften a little within an event too (rubber scragging, warming lead); the events of the reference show how much, and
with which scatter. Cycles larger than any in the reference are not used, but they may have softened those that follow.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise

import numpy as np
import scipy

from core.arrays import Indices, Vector
from core.drift.alarms import Alarm, printed_change
from core.drift.baseline import Baseline
from core.drift.change_statistics import LEVEL, ChangeSize
from core.drift.deviations import is_in_range, relative_change
from core.drift.quantities import Quantity
from core.drift.series import SeriesArrays, SeriesEvent

WITHIN = "within"
"""Name of the rule, as stored."""
WITHIN_RATE = 0.003
"""Share of sequences of `HUNDRED` healthy events in which the rule raises an alarm: its threshold is set for that.
A choice; docs/operate/drift.md has the share that was measured."""
FEWEST_CYCLES = 3
"""Cycles needed before the largest, and after it. A choice: the fewest whose median disregards one outlier."""
USUAL_STD = 0.02
"""Prior standard deviation, among buildings, of the mean change within a healthy event; relative. A choice."""
PRIOR_EVENTS = 4.0
"""Events that the quantity's typical scatter counts for beside those of the reference. A choice."""
SOFTENING_STD = 0.03
"""Standard deviation of healthy softening, per unit of the natural logarithm by which the largest cycle exceeds the
reference; relative. A choice: twice the softening that `core.drift.quantities` states between events."""
OUTLYING = 3.0
"""Typical scatters that an event of the reference counts at most. A choice."""
HUNDRED = 100
"""Events of the sequences for which false-alarm rates are stated."""


@dataclass(frozen=True, slots=True)
class Contrast:
    """Deviation of the cycles after an event's largest, less that of the cycles before it."""

    value: float
    """Natural logarithm."""
    variance: float
    """Variance of the value."""
    excess: float
    """Natural logarithm of the largest amplitude over that of the reference; 0 if it is not larger."""


@dataclass(frozen=True, slots=True)
class UsualChange:
    """Mean change within healthy events, and what a loss has to exceed."""

    size: float
    """Natural logarithm."""
    variance: float
    """Variance of a healthy event's change about it, without that of its measurement."""
    threshold: float
    """Standard deviations that a loss is significant with."""
    half: float
    """Standard deviations of half of the 95 % interval."""


def alarms_within(
    known: Quantity,
    baseline: Baseline,
    arrays: SeriesArrays,
    events: Sequence[SeriesEvent],
    tested: Sequence[int],
) -> tuple[Alarm, ...]:
    """Alarms on single events; none unless the quantity follows amplitude and gets worse by falling.

    Args:
        known: the quantity.
        baseline: baseline of the series.
        arrays: all measurements of the series.
        events: its events.
        tested: indices of the events to test.
    """
    if not known.follows_amplitude or known.harm != "less" or not tested:
        return ()
    every = contrasts(arrays, len(events), baseline)
    reference = set(baseline.events)
    healthy = [one for one, when in zip(every, events, strict=True) if one is not None and when.event in reference]
    usual = usual_change(healthy, known.scatter)
    raised = []
    for n in tested:
        one = every[n]
        lost = None if one is None else damage(one, usual)
        if lost is not None:
            raised.append(_alarm(lost, events[n], baseline))
    return tuple(raised)


def contrasts(arrays: SeriesArrays, count: int, baseline: Baseline) -> list[Contrast | None]:
    """Contrast of each of `count` events; None where too few cycles in the baseline's range come before or after."""
    columns = baseline.model.columns(arrays)
    residual = arrays.value - baseline.model.offset(arrays) - columns @ baseline.coefficients
    variance = arrays.variance + baseline.scatter.own**2
    edges = np.searchsorted(arrays.event, np.arange(count + 1))
    every: list[Contrast | None] = []
    for first, end in pairwise(edges):
        largest = int(first + arrays.amplitude[first:end].argmax())
        before, after = _parts(arrays, np.arange(first, end), largest, baseline)
        if min(before.size, after.size) < FEWEST_CYCLES:
            every.append(None)
            continue
        (one, of_one), (other, of_other) = (_median(residual, variance, part) for part in (before, after))
        turned = columns[after].mean(axis=0) - columns[before].mean(axis=0)
        of_curve = float(turned @ baseline.covariance @ turned)
        excess = max(0.0, float(arrays.amplitude[largest]) - baseline.model.high)
        every.append(Contrast(other - one, of_one + of_other + of_curve, excess))
    return every


def usual_change(healthy: Sequence[Contrast], typical: float) -> UsualChange:
    """The change within healthy events.

    Args:
        healthy: contrasts of the events of the reference.
        typical: typical standard deviation of the quantity between events.
    """
    values = np.array([one.value for one in healthy])
    variances = np.array([one.variance for one in healthy])
    middle = float(np.median(values)) if healthy else 0.0
    beyond = np.minimum((values - middle) ** 2 - variances, OUTLYING**2 * typical**2)
    scatter = (PRIOR_EVENTS * typical**2 + float(np.maximum(beyond, 0.0).sum())) / (PRIOR_EVENTS + len(healthy))
    weight = 1 / (variances + scatter)
    of_mean = 1 / (float(weight.sum()) + USUAL_STD**-2)
    freedom = PRIOR_EVENTS + len(healthy)
    return UsualChange(
        size=of_mean * float(weight @ values),
        variance=scatter + of_mean,
        threshold=float(scipy.stats.t.isf(WITHIN_RATE / HUNDRED, freedom)),
        half=float(scipy.stats.t.isf((1 - LEVEL) / 2, freedom)),
    )


def damage(contrast: Contrast, usual: UsualChange) -> ChangeSize | None:
    """The loss within an event; None unless it is significant."""
    std = float(np.sqrt(contrast.variance + usual.variance + (SOFTENING_STD * contrast.excess) ** 2))
    size = contrast.value - usual.size
    if size > -std * usual.threshold:
        return None
    half = std * usual.half
    return ChangeSize(size, std, size - half, size + half)


def _parts(arrays: SeriesArrays, rows: Indices, largest: int, baseline: Baseline) -> tuple[Indices, Indices]:
    """The cycles before the largest and after it, of those in the range of the baseline."""
    inside = rows[is_in_range(arrays.amplitude[rows], baseline)]
    when = arrays.time[inside]
    return inside[when < arrays.time[largest]], inside[when > arrays.time[largest]]


def _median(residual: Vector, variance: Vector, part: Indices) -> tuple[float, float]:
    """Median, and its variance for normal values (π/2 that of their mean)."""
    return float(np.median(residual[part])), float(np.pi / 2 * variance[part].mean() / part.size)


def _alarm(lost: ChangeSize, when: SeriesEvent, baseline: Baseline) -> Alarm:
    known = baseline.model.quantity
    drift, low, high = (relative_change(value, baseline) for value in (lost.size, lost.low, lost.high))
    return Alarm(
        rule=WITHIN,
        is_sure=True,
        onset=when.event,
        after=when.event,
        by=when.event,
        raised=when.event,
        events=(when.event,),
        drift=drift,
        low=low,
        high=high,
        false_alarms=WITHIN_RATE,
        causes=(),
        message=_message(known, when.time, printed_change(known, drift, low, high)),
    )


def _message(known: Quantity, when: datetime, change: str) -> str:
    """One sentence with the change and its interval."""
    return (
        f"within the event of {when:%Y-%m-%d %H:%M} UTC the {known.title} changed by {change}: its cycles after the "
        "largest against those before it, at matched amplitude"
    )
