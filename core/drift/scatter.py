"""Scatter of a series: between healthy events, within an event, and the curvature of its baseline.

All three are posterior means over one grid, with the coefficients of the baseline and the common errors of the events
integrated out. With few events the data alone cannot determine them, and the uncertainty of the scatter between events
limits how sure a test can be.
"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Matrix, Tensor, Vector
from core.drift.quantities import Quantity

EVENT_FACTORS = np.geomspace(1 / 6, 8.0, 12)
"""Grid of the scatter between events, over the quantity's typical one. A choice."""
EVENT_SPREAD = 0.7
"""Prior standard deviation of the logarithm of the scatter between events, among buildings and quantities: a factor of
two either way. A choice."""
WITHIN_FACTORS = np.geomspace(1 / 16, 4.0, 5)
"""Grid of the scatter within an event, over the quantity's typical one. A choice."""
WITHIN_SPREAD = 1.2
"""Prior standard deviation of the logarithm of the scatter within an event: a factor of three either way. A choice."""
CURVATURES = np.array([0.01, 0.03, 0.1, 0.3])
"""Grid of the standard deviation of the second differences of the curve's coefficients.
A choice: from nearly straight lines to bends of 30 % within a knot's distance."""
FEWEST_DEGREES = 5.0
"""Degrees of freedom at least: more than four, else the variance of a scaled inverse chi-square is not finite."""
MOST_DEGREES = 1000.0
"""Degrees of freedom at most. A choice."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Standard deviations of what the baseline does not explain; logarithm, or SI units."""

    events: float
    """Between events."""
    own: float
    """Between the measurements of an event, without their own standard deviations."""
    bend: float
    """Second differences of the curve's coefficients."""
    freedom: float
    """Degrees of freedom of the variance between events, as of a scaled inverse chi-square distribution."""


@dataclass(frozen=True, slots=True, eq=False)
class WeightedSums:
    """Sums over n measurements x, y with precisions w, of m events: all that the likelihood needs."""

    information: Matrix
    """(p, p) Σ w x xᵀ"""
    event_rows: Matrix
    """(m, p) Σ w x of each event"""
    weight: Vector
    """(m,) Σ w of each event"""
    product: Vector
    """(p,) Σ w x y"""
    event_values: Vector
    """(m,) Σ w y of each event"""
    square: float
    """Σ w y²"""
    log_weight: float
    """Σ log w"""


def weighted_sums(columns: Matrix, value: Vector, weight: Vector, event: Indices, count: int) -> WeightedSums:
    """Sums over measurements that are sorted by their events.

    Args:
        columns: (n, p) design matrix.
        value: (n,) values.
        weight: (n,) precisions.
        event: (n,) index of the event, ascending.
        count: number of events, each with one measurement at least.
    """
    weighted = columns * weight[:, None]
    return WeightedSums(
        information=columns.T @ weighted,
        event_rows=np.add.reduceat(weighted, np.searchsorted(event, np.arange(count))),
        weight=np.asarray(np.bincount(event, weight, count), dtype=float),
        product=weighted.T @ value,
        event_values=np.asarray(np.bincount(event, weight * value, count), dtype=float),
        square=float(weight @ value**2),
        log_weight=float(np.log(weight).sum()),
    )


def normal_equations(sums: WeightedSums, events: Vector) -> tuple[Matrix, Vector]:
    """(p, p) matrix and (p,) right-hand side, with the common errors of the events integrated out.

    Args:
        sums: sums over the reference.
        events: (m,) variance of each event's common error.
    """
    shared = sums.event_rows * (events / (1 + events * sums.weight))[:, None]
    return sums.information - sums.event_rows.T @ shared, sums.product - shared.T @ sums.event_values


def estimated_scatter(
    columns: Matrix,
    value: Vector,
    variance: Vector,
    weight: Vector,
    event: Indices,
    inflation: Vector,
    precisions: Tensor,
    known: Quantity,
) -> Scatter:
    """Posterior means over the grid of `EVENT_FACTORS`, `WITHIN_FACTORS` and `CURVATURES`.

    Args:
        columns: (n, p) design matrix.
        value: (n,) values less the baseline's offset.
        variance: (n,) variance of each measurement.
        weight: (n,) robust weight of each measurement, at most 1.
        event: (n,) index of its event, ascending.
        inflation: (m,) robust factor of each event's variance, at least 1.
        precisions: (curvatures, p, p) prior precision of the coefficients, for each of CURVATURES.
        known: the quantity.
    """
    tried = np.outer((known.scatter * EVENT_FACTORS) ** 2, inflation)
    prior = np.linalg.slogdet(precisions).logabsdet
    score = np.empty((WITHIN_FACTORS.size, EVENT_FACTORS.size, CURVATURES.size))
    for i, factor in enumerate(WITHIN_FACTORS):
        precision = weight / (variance + (factor * known.within_event_scatter) ** 2)
        sums = weighted_sums(columns, value, precision, event, inflation.size)
        likelihood = _log_likelihood(sums, tried, precisions)
        score[i] = 0.5 * prior + likelihood - 0.5 * (np.log(factor) / WITHIN_SPREAD) ** 2
    score -= 0.5 * (np.log(EVENT_FACTORS) / EVENT_SPREAD)[None, :, None] ** 2
    share = np.exp(score - score.max())
    share /= share.sum()
    return _mean(share, known)


def _mean(share: Tensor, known: Quantity) -> Scatter:
    """Means over the posterior; degrees of freedom by the mean and variance of a scaled inverse chi-square."""
    of_events, own, bend = share.sum(axis=(0, 2)), share.sum(axis=(1, 2)), share.sum(axis=(0, 1))
    variance = (known.scatter * EVENT_FACTORS) ** 2
    mean = float(of_events @ variance)
    spread = float(of_events @ (variance - mean) ** 2) / mean**2
    return Scatter(
        events=float(np.sqrt(mean)),
        own=known.within_event_scatter * float(np.exp(own @ np.log(WITHIN_FACTORS))),
        bend=float(np.exp(bend @ np.log(CURVATURES))),
        freedom=float(np.clip(4 + 2 / max(spread, 1e-9), FEWEST_DEGREES, MOST_DEGREES)),
    )


def _log_likelihood(sums: WeightedSums, events: Matrix, precisions: Tensor) -> Matrix:
    """Log marginal likelihood, without the determinant of the prior precision.

    Args:
        sums: sums over the reference.
        events: (scatters, m) variance of each event's common error.
        precisions: (curvatures, p, p) prior precision of the coefficients.

    Returns:
        (scatters, curvatures), with coefficients and common errors integrated out.
    """
    share = events / (1 + events * sums.weight)
    size = sums.product.size
    outer = (sums.event_rows[:, :, None] * sums.event_rows[:, None, :]).reshape(-1, size**2)
    information = sums.information - (share @ outer).reshape(-1, size, size)
    product = sums.product - (share * sums.event_values) @ sums.event_rows
    whole = information[:, None] + precisions
    solved = np.linalg.solve(whole, np.broadcast_to(product[:, None, :, None], (*whole.shape[:3], 1)))[..., 0]
    square = (sums.square - share @ sums.event_values**2)[:, None] - np.einsum("ijk,ik->ij", solved, product)
    volume = sums.log_weight - np.log1p(events * sums.weight).sum(axis=1)
    return np.asarray(0.5 * (volume[:, None] - np.linalg.slogdet(whole).logabsdet - square))
