"""Damage within one event: the cycles after its largest against those before it, at matched amplitude.

Each cycle is compared with the baseline at its own amplitude, which removes the effect of the curve. Healthy layers
soften a little within an event too (rubber scragging, warming lead); the events of the reference show how much, and
with which scatter. Cycles larger than any in the reference are not used, but they may have softened those that follow.
"""

from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise

import numpy as np
import scipy

from core.arrays import Indices, Vector
from core.drift.alarms import Alarm, printed_change
from core.drift.baseline import Baseline
from core.drift.change_statistics import LEVEL, ChangeSize
from core.drift.deviations import EventSummaries, is_in_range, relative_change
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


def alarms_within(known: Quantity, baseline: Baseline, summaries: EventSummaries, tested: Indices) -> tuple[Alarm, ...]:
    """Alarms on single events; none unless the quantity follows amplitude and gets worse by falling.

    Args:
        known: the quantity.
        baseline: baseline of the series.
        summaries: the events of the series.
        tested: indices of the events to test.
    """
    if not known.follows_amplitude or known.harm != "less":
        return ()
    tested = tested[np.isfinite(summaries.contrast[tested])]
    if not tested.size:
        return ()
    healthy = np.isin(summaries.event, baseline.events) & np.isfinite(summaries.contrast)
    usual = usual_change(summaries.contrast[healthy], summaries.contrast_variance[healthy], known.scatter)
    excess = np.maximum(0.0, summaries.peak - baseline.model.high)
    std = np.sqrt(summaries.contrast_variance + usual.variance + (SOFTENING_STD * excess) ** 2)
    size = summaries.contrast - usual.size
    lost = tested[size[tested] <= -std[tested] * usual.threshold]
    return tuple(
        _alarm(
            ChangeSize(value, error, value - error * usual.half, value + error * usual.half), summaries.at(n), baseline
        )
        for n, value, error in zip(lost.tolist(), size[lost].tolist(), std[lost].tolist(), strict=True)
    )


def contrasts(arrays: SeriesArrays, count: int, baseline: Baseline) -> tuple[Vector, Vector]:
    """`contrast` and `contrast_variance` of `count` events; NaN where too few cycles in range come before or after."""
    value, of_value = np.full(count, np.nan), np.full(count, np.nan)
    edges = np.searchsorted(arrays.event, np.arange(count + 1))
    if not baseline.model.quantity.follows_amplitude or np.diff(edges).max() <= 2 * FEWEST_CYCLES:
        return value, of_value
    columns = baseline.model.columns(arrays)
    residual = arrays.value - baseline.model.offset(arrays) - columns @ baseline.coefficients
    variance = arrays.variance + baseline.scatter.own**2
    for n, (first, end) in enumerate(pairwise(edges)):
        largest = int(first + arrays.amplitude[first:end].argmax())
        before, after = _parts(arrays, np.arange(first, end), largest, baseline)
        if min(before.size, after.size) < FEWEST_CYCLES:
            continue
        (one, of_one), (other, of_other) = (_median(residual, variance, part) for part in (before, after))
        turned = columns[after].mean(axis=0) - columns[before].mean(axis=0)
        value[n], of_value[n] = other - one, of_one + of_other + float(turned @ baseline.covariance @ turned)
    return value, of_value


def usual_change(values: Vector, variances: Vector, typical: float) -> UsualChange:
    """The change within healthy events.

    Args:
        values: (m,) contrasts of the events of the reference.
        variances: (m,) their variances.
        typical: typical standard deviation of the quantity between events.
    """
    middle = float(np.median(values)) if values.size else 0.0
    beyond = np.minimum((values - middle) ** 2 - variances, OUTLYING**2 * typical**2)
    scatter = (PRIOR_EVENTS * typical**2 + float(np.maximum(beyond, 0.0).sum())) / (PRIOR_EVENTS + values.size)
    weight = 1 / (variances + scatter)
    of_mean = 1 / (float(weight.sum()) + USUAL_STD**-2)
    freedom = PRIOR_EVENTS + values.size
    return UsualChange(
        size=of_mean * float(weight @ values),
        variance=scatter + of_mean,
        threshold=float(scipy.stats.t.isf(WITHIN_RATE / HUNDRED, freedom)),
        half=float(scipy.stats.t.isf((1 - LEVEL) / 2, freedom)),
    )


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
