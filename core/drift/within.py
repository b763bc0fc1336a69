"""Did an event damage what it shook: do its later cycles differ from its earlier ones at matched amplitude?

Each cycle is compared with the baseline at its own amplitude, so that what the curve explains drops out. Healthy layers
soften a little within an event too (rubber is scragged, lead warms); how much, and how differently, the reference's
events tell. Of cycles larger than any in the reference nothing is known, but they may have softened what follows.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import t as student

from core.arrays import Indices, Vector
from core.drift.baseline import Baseline
from core.drift.event_value import is_within
from core.drift.rules import WITHIN_RATE
from core.drift.sequential import LEVEL, Change
from core.drift.series import SeriesArrays

FEWEST = 3
"""Cycles before the largest, and after it."""
USUAL = 0.02
"""Standard deviation among buildings of the mean change within a healthy event; relative."""
BELIEVED = 4.0
"""Events that the quantity's typical scatter counts for beside the reference's own."""
SOFTENING = 0.03
"""Standard deviation of the change that healthy softening brings for each unit of the natural logarithm by which the
largest cycle exceeds the reference."""
OUTLYING = 3.0
"""Standard deviations that a reference's event counts at most."""
HUNDRED = 100
"""Events of the sequence that a false-alarm rate is stated for."""


@dataclass(frozen=True, slots=True)
class Contrast:
    """Of the cycles after an event's largest to those before."""

    value: float
    variance: float
    excess: float
    """By which the largest exceeds the reference, natural logarithm; 0 if it does not."""


def contrasts(points: SeriesArrays, count: int, baseline: Baseline) -> list[Contrast | None]:
    """Of each of `count` events; None where too few cycles within the baseline's range come before or after."""
    columns = baseline.model.columns(points)
    residual = points.value - baseline.model.offset(points) - columns @ baseline.coefficients
    variance = points.variance + baseline.scatter.own**2
    edges = np.searchsorted(points.event, np.arange(count + 1))
    found: list[Contrast | None] = []
    for first, end in pairwise(edges):
        largest = int(first + points.amplitude[first:end].argmax())
        before, after = _parts(points, np.arange(first, end), largest, baseline)
        if min(before.size, after.size) < FEWEST:
            found.append(None)
            continue
        (one, of_one), (other, of_other) = (_mean(residual, variance, part) for part in (before, after))
        turned = columns[after].mean(axis=0) - columns[before].mean(axis=0)
        of_curve = float(turned @ baseline.covariance @ turned)
        excess = max(0.0, float(points.amplitude[largest]) - baseline.model.high)
        found.append(Contrast(other - one, of_one + of_other + of_curve, excess))
    return found


def _parts(points: SeriesArrays, rows: Indices, largest: int, baseline: Baseline) -> tuple[Indices, Indices]:
    """The cycles before the largest and after it that the baseline can judge."""
    inside = rows[is_within(points.amplitude[rows], baseline)]
    when = points.time[inside]
    return inside[when < points.time[largest]], inside[when > points.time[largest]]


def damage(found: Contrast, healthy: list[Contrast], typical: float) -> Change | None:
    """The loss within an event, where there surely is one.

    Args:
        found: of the event.
        healthy: of the reference's events.
        typical: standard deviation from event to event that is typical of the quantity.
    """
    values = np.array([one.value for one in healthy])
    variances = np.array([one.variance for one in healthy])
    middle = float(np.median(values)) if healthy else 0.0
    beyond = np.minimum((values - middle) ** 2 - variances, OUTLYING**2 * typical**2)
    scatter = (BELIEVED * typical**2 + float(np.maximum(beyond, 0.0).sum())) / (BELIEVED + len(healthy))
    weight = 1 / (variances + scatter)
    of_mean = 1 / (float(weight.sum()) + USUAL**-2)
    usual = of_mean * float(weight @ values)
    freedom = BELIEVED + len(healthy)
    std = np.sqrt(found.variance + scatter + of_mean + (SOFTENING * found.excess) ** 2)
    size = found.value - usual
    if size > -std * student.isf(WITHIN_RATE / HUNDRED, freedom):
        return None
    half = float(std * student.isf((1 - LEVEL) / 2, freedom))
    return Change(size, float(std), size - half, size + half)


def _mean(residual: Vector, variance: Vector, part: Indices) -> tuple[float, float]:
    """Median, and the variance of a median of normal values (π/2 that of their mean)."""
    return float(np.median(residual[part])), float(np.pi / 2 * variance[part].mean() / part.size)
