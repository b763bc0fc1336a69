"""Baseline: the value expected of a healthy building at an amplitude and a temperature, with its uncertainty.

A linear mixed model, y = X β + u + e, with an error u common to the measurements of an event and an error e of each. X
holds a cubic spline over the logarithm of the amplitude with equidistant knots (P-spline; Eilers and Marx, 1996), whose
penalty on second differences is a Gaussian prior of β (Lang and Brezger, 2004): where there are no data, the curve goes
on straight and its variance grows. One more column is the temperature or, where it was not measured, two are a yearly
wave. β is estimated by generalised least squares with its prior, made robust by Huber's weights (1964) on measurements
and on events.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from scipy.linalg import block_diag, cho_factor, cho_solve

from core.arrays import Matrix, Vector
from core.drift.ageing import Ageing
from core.drift.quantities import Quantity
from core.drift.scatter import CURVATURES, Scatter, estimated_scatter, normal_equations, weighted_sums
from core.drift.series import SeriesArrays

FEWEST_EVENTS = 20
"""Events of a reference at least: a standard deviation from 20 values is known to ± 16 %. A choice."""
CURVE_ERROR = 0.5
"""Standard deviation of the curve over the scatter of events up to which the curve counts as determined: it then adds
at most a quarter to the variance of an event's value."""
HUBER = 2.0
"""Standard deviations beyond which a measurement, or an event, gets less weight. A choice: with normal errors the
estimate keeps 99 % of its efficiency."""
ROUNDS = 3
"""Rounds of reweighting. A choice."""
KNOT_SPACING = 0.5
"""Distance of the knots in the natural logarithm of amplitude: the curve of a yielding layer bends over one to two."""
KNOT_MARGIN = 2.5
"""Natural logarithm of amplitude by which the knots reach beyond the data, a factor of twelve. Amplitudes farther away
are assumed to lie there."""
DEGREE = 3
"""Degree of the spline."""
LEVEL_STD = 3.0
"""Prior standard deviation of each coefficient about the median of the reference: wide, so that the data alone decide
level and slope."""
SEASONAL_STD = 10.0
"""K, standard deviation of the layer's temperature over the year, where it was not measured. A choice."""
MEASURED_SHARE = 0.8
"""Share of the reference's measurements that need a temperature for its coefficient to be estimated. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class BaselineModel:
    """Columns of the linear model, and the prior of their coefficients."""

    quantity: Quantity
    level: float
    """Median of the reference's values: logarithm, or SI units."""
    size: float
    """Unit in which changes are scaled: 1 for a logarithm, else 100 typical scatters of events in SI units."""
    low: float
    """Natural logarithm of the smallest amplitude of the reference."""
    high: float
    """Natural logarithm of its largest amplitude."""
    temperature: float | None
    """°C, mean of the reference; None where it was not measured or has no influence."""
    swing: float
    """K, standard deviation of the temperature where it is not known."""
    epoch: float = 0.0
    """s since 1970-01-01 UTC, mean time of the reference."""
    ageing: Ageing | None = None
    """Hardening of the rubber; None where it is not known, or has no influence."""

    @property
    def knots(self) -> Vector:
        """Equidistant knots of the spline, `DEGREE` more on each side than the interval needs."""
        count = int(np.ceil((self.high - self.low + 2 * KNOT_MARGIN) / KNOT_SPACING))
        middle = (self.low + self.high) / 2
        return np.asarray(middle + KNOT_SPACING * (np.arange(count + 2 * DEGREE + 1) - (count / 2 + DEGREE)))

    @property
    def is_seasonal(self) -> bool:
        """True if a yearly wave replaces the temperature."""
        return self.quantity.follows_temperature and self.temperature is None

    def columns(self, arrays: SeriesArrays) -> Matrix:
        """(n, p) design matrix of n measurements."""
        parts = [self._curve(arrays.amplitude)]
        if self.temperature is not None:
            parts.append(np.nan_to_num(arrays.temperature - self.temperature)[:, None])
        if self.is_seasonal:
            parts.append(np.column_stack([np.cos(arrays.season), np.sin(arrays.season)]))
        return np.hstack(parts)

    def offset(self, arrays: SeriesArrays) -> Vector:
        """(n,) expected values with all coefficients zero: level, ageing, and the typical effect of the temperature."""
        level = self.level + (0.0 if self.ageing is None else self.ageing.change(arrays.time, self.epoch))
        if self.temperature is None:
            return np.full(arrays.value.size, level)
        typical, _ = self.quantity.temperature_coefficient
        return level + typical * np.nan_to_num(arrays.temperature - self.temperature)

    def unmeasured_temperature(self, arrays: SeriesArrays) -> Vector:
        """(n,) K², variance of the temperatures that were not measured; 0 where they were."""
        if self.temperature is None:
            return np.zeros(arrays.value.size)
        return np.where(np.isnan(arrays.temperature), self.swing**2, 0.0)

    def precision(self, curvature: float) -> Matrix:
        """(p, p) prior precision of the coefficients.

        Args:
            curvature: standard deviation of the second differences of the curve's coefficients.
        """
        if not self.quantity.follows_amplitude:
            curve = np.eye(1) / (LEVEL_STD * self.size) ** 2
        else:
            size = self.knots.size - DEGREE - 1
            bends = np.diff(np.eye(size), 2, axis=0)
            curve = bends.T @ bends / curvature**2 + np.eye(size) / LEVEL_STD**2
        typical, among = self.quantity.temperature_coefficient
        if self.temperature is not None:
            return np.asarray(block_diag(curve, among**-2))
        if self.is_seasonal:
            return np.asarray(block_diag(curve, np.eye(2) / (np.hypot(typical, among) * SEASONAL_STD) ** 2))
        return curve

    def _curve(self, amplitude: Vector) -> Matrix:
        if not self.quantity.follows_amplitude:
            return np.ones((amplitude.size, 1))
        knots = self.knots
        within = np.clip(amplitude, knots[DEGREE], knots[-DEGREE - 1])
        return np.asarray(scipy.interpolate.BSpline.design_matrix(within, knots, DEGREE).toarray())


@dataclass(frozen=True, slots=True, eq=False)
class Baseline:
    """Fitted baseline of a series."""

    events: tuple[int, ...]
    """Identifiers of the reference's events."""
    model: BaselineModel
    coefficients: Vector
    """(p,) posterior mean."""
    covariance: Matrix
    """(p, p) posterior covariance of the coefficients."""
    scatter: Scatter
    events_needed: int
    """Events that the reference lacks until the curve is determined."""
    inputs: str = ""
    """SHA-256 of all that core.drift.monitor fitted it to; empty where it is not known."""

    @property
    def range(self) -> tuple[float, float] | None:
        """Smallest and largest amplitude of the reference, SI units; None if the quantity does not follow amplitude."""
        if not self.model.quantity.follows_amplitude:
            return None
        return float(np.exp(self.model.low)), float(np.exp(self.model.high))

    def expected(self, amplitude: Vector, temperature: float | None = None) -> tuple[Vector, Vector]:
        """Expected values at the age of the reference, and the standard deviations of healthy events about them.

        The standard deviations hold the errors of the curve and the scatter between events, but no error of
        measurement.

        Args:
            amplitude: (n,) SI units.
            temperature: °C; None for the mean of the reference, or of the year.

        Returns:
            (n,) expected values and (n,) standard deviations; natural logarithm of SI units where the quantity's
            logarithm is monitored, else SI units.
        """
        count = amplitude.size
        middle = np.nan if self.model.temperature is None else self.model.temperature
        zeros = np.zeros(count)
        places = SeriesArrays(
            event=np.arange(count),
            time=np.full(count, self.model.epoch),
            value=zeros,
            variance=zeros,
            amplitude=np.log(amplitude) if self.model.quantity.follows_amplitude else zeros,
            temperature=np.full(count, middle if temperature is None else temperature),
        )
        columns = self.model.columns(places)
        if self.model.is_seasonal:
            columns[:, -2:] = 0.0
        variance = np.einsum("ij,jk,ik->i", columns, self.covariance, columns) + self.scatter.events**2
        return self.model.offset(places) + columns @ self.coefficients, np.sqrt(variance)


def baseline_model(known: Quantity, reference: SeriesArrays, ageing: Ageing | None = None) -> BaselineModel:
    """The model that suits a reference of at least one measurement."""
    measured = reference.temperature[~np.isnan(reference.temperature)]
    is_measured = known.follows_temperature and measured.size >= MEASURED_SHARE * reference.value.size
    return BaselineModel(
        quantity=known,
        level=float(np.median(reference.value)),
        size=1.0 if known.is_logarithmic else 100 * known.scatter,
        low=float(reference.amplitude.min()),
        high=float(reference.amplitude.max()),
        temperature=float(measured.mean()) if is_measured else None,
        swing=max(SEASONAL_STD, float(measured.std())) if is_measured else SEASONAL_STD,
        epoch=float(reference.time.mean()),
        ageing=ageing if known.hardens else None,
    )


def fit_baseline(
    known: Quantity, reference: SeriesArrays, events: tuple[int, ...], ageing: Ageing | None = None
) -> Baseline:
    """Fit the baseline to a reference.

    Args:
        known: the quantity.
        reference: measurements of the reference; their `event` is the index into `events`.
        events: identifiers of the reference's events, each with one measurement at least.
        ageing: hardening of the rubber, if it is known; of use where the quantity `hardens`.
    """
    model = baseline_model(known, reference, ageing)
    columns = model.columns(reference)
    value = reference.value - model.offset(reference)
    precisions = np.array([model.precision(curvature) for curvature in CURVATURES])
    weight, inflation = np.ones(value.size), np.ones(len(events))
    for _ in range(ROUNDS):
        scatter = estimated_scatter(
            columns, value, reference.variance, weight, reference.event, inflation, precisions, known
        )
        precision = weight / (reference.variance + scatter.own**2)
        sums = weighted_sums(columns, value, precision, reference.event, len(events))
        information, product = normal_equations(sums, scatter.events**2 * inflation)
        factor = cho_factor(information + model.precision(scatter.bend))
        coefficients = cho_solve(factor, product)
        residual = value - columns @ coefficients
        common = np.bincount(reference.event, precision * residual, len(events)) / sums.weight
        inflation = _excess(common / np.sqrt(scatter.events**2 + 1 / sums.weight))
        weight = 1 / _excess((residual - common[reference.event]) / np.sqrt(reference.variance + scatter.own**2))
    covariance = np.ascontiguousarray(cho_solve(factor, np.eye(product.size)))  # as a stored one is read
    of_events = sums.event_rows / sums.weight[:, None]
    error = float(np.mean(np.einsum("ij,jk,ik->i", of_events, covariance, of_events)))
    # The variance of the curve falls in proportion to the number of events.
    enough = len(events) * error / (CURVE_ERROR * scatter.events) ** 2
    needed = max(0, FEWEST_EVENTS - len(events), int(np.ceil(enough - 1e-9)) - len(events))
    return Baseline(events, model, np.asarray(coefficients), covariance, scatter, needed)


def _excess(deviation: Vector) -> Vector:
    """Standard deviations in units of those that get full weight, at least 1."""
    return np.maximum(1.0, np.abs(deviation) / HUBER)
