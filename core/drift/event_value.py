"""How far did an event deviate from what was expected of it, how surely, and what else could explain it?"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise

import numpy as np

from core.arrays import Matrix, Vector
from core.drift.baseline import HUBER, Baseline
from core.drift.points import Points
from core.quality import Finding

MARGIN = 0.05
"""Of the natural logarithm of amplitude by which an observation may lie outside the baseline's range."""
ROUNDS = 2


@dataclass(frozen=True, slots=True)
class EventNotes:
    """What is known of an event beside its observations."""

    sensor_findings: tuple[Finding, ...] = ()
    """Of the sensors that the series is measured with. Any but a note keeps the event's value out of every rule."""

    @property
    def inhibiting(self) -> tuple[Finding, ...]:
        """Those for which the event's value is not trusted."""
        return tuple(finding for finding in self.sensor_findings if finding.severity != "note")


@dataclass(frozen=True, slots=True)
class EventValue:
    """An event's observations against the baseline, as one number."""

    event: int
    time: datetime
    value: float
    """Relative change from what was expected, -0.08 for 8 % less; of a quantity whose logarithm is not watched, the
    change in SI units."""
    std: float
    """The same unit: of the curve, the scatter of healthy events and the observations themselves."""
    count: int
    """Observations it is from."""
    is_reference: bool
    is_beyond: bool
    """Whether all its amplitudes lie outside what the baseline has seen: it takes part in no rule."""
    is_inhibited: bool
    """Whether a sensor finding keeps it out of every rule."""
    causes: tuple[str, ...]
    """What else than a change of the building could explain a deviation, for people."""


@dataclass(frozen=True, slots=True, eq=False)
class Deviation:
    """Of one event, with what its covariance with others takes."""

    value: float
    """Natural logarithm, or SI units."""
    variance: float
    """Of the observations alone."""
    row: Vector
    """(p,) mean of their columns."""
    count: int
    is_beyond: bool


def deviations(points: Points, count: int, baseline: Baseline) -> list[Deviation]:
    """Of each of `count` events, all with one observation at least."""
    columns = baseline.design.columns(points)
    residual = points.value - baseline.design.offset(points) - columns @ baseline.coefficients
    variance = points.variance + baseline.scatter.own**2
    within = is_within(points.amplitude, baseline)
    edges = np.searchsorted(points.event, np.arange(count + 1))
    unknown = _of_unknown_temperature(points, baseline)
    found = []
    for first, end in pairwise(edges):
        rows = np.arange(first, end)
        inside = rows[within[first:end]]
        chosen = inside if inside.size else rows
        value, own, row = _mean(residual[chosen], variance[chosen], columns[chosen])
        found.append(Deviation(value, own + float(unknown[chosen].mean()), row, chosen.size, not inside.size))
    return found


def covariance(found: Sequence[Deviation], baseline: Baseline) -> Matrix:
    """(n, n) of the deviations of healthy events: all share the baseline's error, each has its own scatter."""
    rows = np.array([one.row for one in found])
    own = np.array([one.variance for one in found]) + baseline.scatter.events**2
    return np.asarray(rows @ baseline.covariance @ rows.T + np.diag(own))


def is_within(amplitude: Vector, baseline: Baseline) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(n,) whether the baseline has seen such amplitudes, given by their natural logarithm."""
    return (amplitude >= baseline.design.low - MARGIN) & (amplitude <= baseline.design.high + MARGIN)


def relative(value: float, baseline: Baseline) -> float:
    """As a relative change where the logarithm is watched, else as it is."""
    return float(np.expm1(value)) if baseline.design.quantity.is_logarithmic else value


def _mean(residual: Vector, variance: Vector, columns: Matrix) -> tuple[float, float, Vector]:
    """Huber's mean from the median on, its variance and the mean of the columns with the same weights."""
    middle = float(np.median(residual))
    for _ in range(ROUNDS):
        weight = 1 / (variance * np.maximum(1.0, np.abs(residual - middle) / (HUBER * np.sqrt(variance))))
        share = weight / weight.sum()
        middle = float(share @ residual)
    return middle, float(1 / weight.sum()), share @ columns


def _of_unknown_temperature(points: Points, baseline: Baseline) -> Vector:
    """(n,) variance that a temperature which was not measured brings."""
    if baseline.design.temperature is None:
        return np.zeros(points.value.size)
    usual, _ = baseline.design.quantity.per_kelvin
    slope = usual + float(baseline.coefficients[-1])
    return baseline.design.unknown_temperature(points) * (slope**2 + float(baseline.covariance[-1, -1]))
