"""Deviations of events from the baseline, their uncertainty, and their covariance.

The deviations of healthy events are correlated: they share the error of the baseline, and the softening that large
earthquakes leave behind. Rubber that is stretched farther than before softens (scragging, the Mullins effect) and
recovers with time. How much has recovered is unknown, so softening is a common error of the events that follow. Its
standard deviation grows with the logarithm of the ratio of the amplitude to all before, and halves every month.
"""

from dataclasses import dataclass, fields
from datetime import UTC, datetime, timedelta

import numpy as np

from core.arrays import Indices, Mask, Matrix, Vector
from core.drift.baseline import HUBER, Baseline
from core.drift.series import SeriesArrays, SeriesEvent
from core.record import Finding

MARGIN = 0.05
"""Natural logarithm of amplitude by which a measurement may lie outside the range of the baseline.
A choice: 5 %, a tenth of the distance of the knots."""
ROUNDS = 2
"""Rounds of reweighting of an event's mean. A choice."""
RECOVERY_HALF_LIFE = timedelta(days=30)
"""Time in which half of the softening recovers. A choice; the histories of benchmarks/drift.py recover at this pace, so
that no benchmark tests another one."""
ROUNDING, NEGLIGIBLE = 1e-10, 1e-4
"""Relative difference of numbers that are the same but for rounding, and logarithm or m of numbers that are as good as
0. A choice: six decimal digits more than double precision errs by, and far below any scatter."""
SOFTENING_WITHIN = 0.5
"""Share of the softening that the earthquake's own cycles show: those after its largest. A choice."""


@dataclass(frozen=True, slots=True)
class EventNotes:
    """Information on an event beside its measurements."""

    sensor_findings: tuple[Finding, ...] = ()
    """Data quality findings on the sensors of the series. Any but a note excludes the event's value from the rules."""

    @property
    def excluding(self) -> tuple[Finding, ...]:
        """The findings that exclude the event's value."""
        return tuple(finding for finding in self.sensor_findings if finding.severity != "note")


@dataclass(frozen=True, slots=True)
class EventValue:
    """The measurements of an event against the baseline, as one number."""

    event: int
    """Identifier, as in the series."""
    time: datetime
    """Time of its first measurement, aware."""
    value: float
    """Relative change from the expected value, -0.08 for 8 % less; a change in SI units where the logarithm is not
    monitored."""
    std: float
    """Standard deviation in the same unit: of the curve, of healthy events about it, and of the measurements."""
    count: int
    """Measurements that it is the mean of."""
    is_reference: bool
    """True if the event belongs to the reference."""
    is_out_of_range: bool
    """True if all its amplitudes lie outside the range of the baseline, which excludes it from the rules."""
    is_excluded: bool
    """True if a sensor finding excludes it from the rules."""
    causes: tuple[str, ...]
    """Possible causes of a deviation other than a change of the building, for people."""


@dataclass(frozen=True, slots=True, eq=False)
class EventSummaries:
    """Deviations of n events from the baseline, in order of time, with all that later results need of them."""

    event: Indices
    """(n,) identifiers, as in the series."""
    time: Vector
    """(n,) s since 1970-01-01 UTC, of the first measurement."""
    value: Vector
    """(n,) robust mean of the deviations from the baseline; natural logarithm, or SI units."""
    variance: Vector
    """(n,) variance of the value from the measurements alone."""
    row: Matrix
    """(n, p) mean of the measurements' rows of the design matrix."""
    count: Indices
    """(n,) number of measurements."""
    is_out_of_range: Mask
    """(n,) whether all amplitudes lie outside the range of the baseline."""
    has_temperature: Mask
    """(n,) whether the temperature was measured."""
    peak: Vector
    """(n,) natural logarithm of the largest amplitude."""
    contrast: Vector
    """(n,) deviation of the cycles after the largest less that of those before it; NaN where there are too few."""
    contrast_variance: Vector
    """(n,) variance of the contrast; NaN where there is none."""

    def at(self, place: int) -> SeriesEvent:
        """The event at an index."""
        return SeriesEvent(int(self.event[place]), datetime.fromtimestamp(float(self.time[place]), UTC))

    def subset(self, which: Mask | Indices) -> "EventSummaries":
        """The events selected by a mask or by indices."""
        return EventSummaries(*(getattr(self, one.name)[which] for one in fields(self)))

    def joined(self, other: "EventSummaries") -> "EventSummaries":
        """The events of both, in order of time."""
        both = EventSummaries(
            *(np.concatenate([getattr(self, one.name), getattr(other, one.name)]) for one in fields(self))
        )
        return both.subset(np.lexsort((both.event, both.time)))

    def same_until(self, other: "EventSummaries") -> int:
        """Number of the first events that have the same numbers in another summary, but for rounding."""
        count = min(self.event.size, other.event.size)
        if self.row.shape[1] != other.row.shape[1]:
            return 0
        same = np.ones(count, dtype=bool)
        for one in fields(self):
            first, second = (getattr(side, one.name)[:count] for side in (self, other))
            if first.dtype.kind == "f":
                close = np.isclose(first, second, rtol=ROUNDING, atol=ROUNDING * NEGLIGIBLE, equal_nan=True)
                same &= close if close.ndim == 1 else close.all(axis=1)
            else:
                same &= first == second
        return count if same.all() else int(same.argmin())


def deviations(arrays: SeriesArrays, count: int, baseline: Baseline) -> tuple[Vector, Vector, Matrix, Indices, Mask]:
    """Robust means of the deviations of `count` events, each with one measurement at least.

    Measurements outside the range of the baseline count only for events that have no others.

    Returns:
        `value`, `variance`, `row`, `count` and `is_out_of_range` of `EventSummaries`.
    """
    inside = is_in_range(arrays.amplitude, baseline)
    is_out = np.bincount(arrays.event[inside], minlength=count) == 0
    chosen = arrays.subset(inside | is_out[arrays.event])
    columns = baseline.model.columns(chosen)
    residual = chosen.value - baseline.model.offset(chosen) - columns @ baseline.coefficients
    variance = chosen.variance + baseline.scatter.own**2
    value, weight = _means(residual, variance, chosen.event)
    edges = np.searchsorted(chosen.event, np.arange(count))
    whole = np.add.reduceat(weight, edges)
    rows = np.add.reduceat(weight[:, None] * columns, edges) / whole[:, None]
    unmeasured = np.add.reduceat(weight * _unmeasured_temperature_variance(chosen, baseline), edges) / whole
    return value, 1 / whole + unmeasured, rows, np.bincount(chosen.event), is_out


def common_errors(summaries: EventSummaries, baseline: Baseline) -> Matrix:
    """(n, errors) errors that events share, each by one standard deviation: of the baseline, softening and ageing."""
    of_curve = summaries.row @ np.linalg.cholesky(baseline.covariance)
    return np.hstack([of_curve, softening_std(summaries, baseline), ageing_std(summaries, baseline)])


def own_variance(summaries: EventSummaries, baseline: Baseline) -> Vector:
    """(n,) variance of each deviation of a healthy event beside the errors that events share."""
    return np.asarray(summaries.variance + baseline.scatter.events**2)


def softening_std(summaries: EventSummaries, baseline: Baseline) -> Matrix:
    """(n, earthquakes) standard deviation, at each event, of the loss left by each earthquake beyond all before."""
    if baseline.model.quantity.softening == 0.0:
        return np.zeros((summaries.event.size, 0))
    excess = amplitude_excess(summaries.peak, baseline)
    half_lives = summaries.time / RECOVERY_HALF_LIFE.total_seconds()
    since = half_lives[:, None] - half_lives[None, excess > 0]
    after = np.where(since > 0, 0.5 ** np.maximum(since, 0.0), np.where(since == 0, SOFTENING_WITHIN, 0.0))
    return np.asarray(baseline.model.quantity.softening * after * excess[excess > 0])


def ageing_std(summaries: EventSummaries, baseline: Baseline) -> Matrix:
    """(n, 1) error of the expected hardening at each event, by one standard deviation of its rate; (n, 0) without."""
    model = baseline.model
    if model.ageing is None:
        return np.zeros((summaries.event.size, 0))
    return model.ageing.change_std(summaries.time, model.epoch)[:, None]


def amplitude_excess(peaks: Vector, baseline: Baseline) -> Vector:
    """(n,) natural logarithm of an event's largest amplitude over that of the reference and all events before.

    0 where it is not larger.

    Args:
        peaks: (n,) natural logarithm of the largest amplitude of each event, in order of time.
        baseline: baseline of the series.
    """
    before = np.maximum.accumulate(np.concatenate([[baseline.model.high], peaks]))[:-1]
    return np.asarray(np.maximum(0.0, peaks - before))


def is_in_range(amplitude: Vector, baseline: Baseline) -> Mask:
    """(n,) whether amplitudes, as natural logarithms, lie in the range of the baseline, give or take `MARGIN`."""
    return (amplitude >= baseline.model.low - MARGIN) & (amplitude <= baseline.model.high + MARGIN)


def relative_change(value: float, baseline: Baseline) -> float:
    """A deviation as a relative change where the logarithm is monitored; else unchanged, in SI units."""
    return float(np.expm1(value)) if baseline.model.quantity.is_logarithmic else value


def _means(residual: Vector, variance: Vector, event: Indices) -> tuple[Vector, Vector]:
    """Huber's mean of each event, starting from its median, and the weights of the measurements; events ascending."""
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


def _unmeasured_temperature_variance(arrays: SeriesArrays, baseline: Baseline) -> Vector:
    """(n,) variance of the value that a temperature without a measurement adds."""
    if baseline.model.temperature is None:
        return np.zeros(arrays.value.size)
    typical, _ = baseline.model.quantity.temperature_coefficient
    slope = typical + float(baseline.coefficients[-1])
    return baseline.model.unmeasured_temperature(arrays) * (slope**2 + float(baseline.covariance[-1, -1]))
