"""How far did an event deviate from what was expected of it, how surely, and what else could explain it?"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from core.arrays import Indices, Mask, Matrix, Vector
from core.drift.baseline import HUBER, Baseline
from core.drift.series import SeriesArrays
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
    def excluding(self) -> tuple[Finding, ...]:
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
    is_excluded: bool
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


def deviations(points: SeriesArrays, count: int, baseline: Baseline) -> list[Deviation]:
    """Of each of `count` events, all with one observation at least."""
    inside = is_within(points.amplitude, baseline)
    is_beyond = np.bincount(points.event[inside], minlength=count) == 0
    chosen = points.subset(inside | is_beyond[points.event])
    columns = baseline.model.columns(chosen)
    residual = chosen.value - baseline.model.offset(chosen) - columns @ baseline.coefficients
    variance = chosen.variance + baseline.scatter.own**2
    value, weight = _means(residual, variance, chosen.event)
    edges = np.searchsorted(chosen.event, np.arange(count))
    whole = np.add.reduceat(weight, edges)
    rows = np.add.reduceat(weight[:, None] * columns, edges) / whole[:, None]
    unknown = np.add.reduceat(weight * _of_unknown_temperature(chosen, baseline), edges) / whole
    counts = np.bincount(chosen.event)
    return [
        Deviation(float(value[n]), float(1 / whole[n] + unknown[n]), rows[n], int(counts[n]), bool(is_beyond[n]))
        for n in range(count)
    ]


def covariance(found: Sequence[Deviation], softened: Matrix, baseline: Baseline) -> Matrix:
    """(n, n) of the deviations of healthy events: they share the baseline's error, and what large ones left behind.

    Args:
        found: n deviations.
        softened: (n, earthquakes) of `core.drift.softening`.
        baseline: that they are from.
    """
    rows = np.array([one.row for one in found])
    own = np.array([one.variance for one in found]) + baseline.scatter.events**2
    return np.asarray(rows @ baseline.covariance @ rows.T + softened @ softened.T + np.diag(own))


def is_within(amplitude: Vector, baseline: Baseline) -> Mask:
    """(n,) whether the baseline has seen such amplitudes, given by their natural logarithm."""
    return (amplitude >= baseline.model.low - MARGIN) & (amplitude <= baseline.model.high + MARGIN)


def relative(value: float, baseline: Baseline) -> float:
    """As a relative change where the logarithm is watched, else as it is."""
    return float(np.expm1(value)) if baseline.model.quantity.is_logarithmic else value


def _means(residual: Vector, variance: Vector, event: Indices) -> tuple[Vector, Vector]:
    """Huber's mean of each event, from its median on, and the weights of the observations; events in order."""
    edges = np.searchsorted(event, np.arange(event[-1] + 1))
    middle = _medians(residual, event, edges)
    std = np.sqrt(variance)
    for _ in range(ROUNDS):
        weight = 1 / (variance * np.maximum(1.0, np.abs(residual - middle[event]) / (HUBER * std)))
        middle = np.add.reduceat(weight * residual, edges) / np.add.reduceat(weight, edges)
    return middle, weight


def _medians(values: Vector, event: Indices, edges: Indices) -> Vector:
    ranked = values[np.lexsort((values, event))]
    counts = np.diff([*edges, values.size])
    return np.asarray(ranked[edges + (counts - 1) // 2] + ranked[edges + counts // 2]) / 2


def _of_unknown_temperature(points: SeriesArrays, baseline: Baseline) -> Vector:
    """(n,) variance that a temperature which was not measured brings."""
    if baseline.model.temperature is None:
        return np.zeros(points.value.size)
    usual, _ = baseline.model.quantity.temperature_coefficient
    slope = usual + float(baseline.coefficients[-1])
    return baseline.model.unmeasured_temperature(points) * (slope**2 + float(baseline.covariance[-1, -1]))
