"""How much do healthy events differ beside all that is known, the cycles of one, and how much does the curve bend?

All three at once by their posterior over a grid, the coefficients integrated out: with few events the data cannot
choose them alone, and how uncertain the scatter of events is decides how far a test may trust it.
"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Matrix, Tensor, Vector
from core.drift.watched import Quantity

FACTORS = np.geomspace(1 / 6, 8.0, 12)
"""Of the typical scatter of events, that are tried."""
SPREAD = 0.7
"""Standard deviation of the logarithm of the scatter of events, among buildings and quantities."""
OWN_FACTORS = np.geomspace(1 / 16, 4.0, 5)
OWN_SPREAD = 1.2
BENDS = np.array([0.01, 0.03, 0.1, 0.3])
"""Standard deviations of the second difference of the curve's coefficients, that are tried."""
FEWEST_DEGREES, MOST_DEGREES = 5.0, 1000.0
"""Of freedom: more than four, else a variance has no spread."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Standard deviations of what no column explains."""

    events: float
    """From event to event."""
    own: float
    """From observation to observation within an event, beside their own standard deviations."""
    bend: float
    """Of the second differences of the curve's coefficients."""
    freedom: float
    """Degrees of freedom of the chi-square distribution that is as uncertain as the variance of events."""


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """What the likelihood needs of a reference, for one scatter of its own."""

    information: Matrix
    """(p, p) ΣxxᵀW"""
    of_events: Matrix
    """(m, p) the same summed over each event: Σxw"""
    weight: Vector
    """(m,) Σw"""
    product: Vector
    """(p,) Σxwy"""
    of_values: Vector
    """(m,) Σwy"""
    square: float
    """Σwy²"""
    log_weight: float
    """Σlog w"""


def sums(columns: Matrix, value: Vector, weight: Vector, event: Indices, count: int) -> Sums:
    """Of (n,) observations with (n, p) columns, sorted by their `count` events, each of which has one at least."""
    weighted = columns * weight[:, None]
    return Sums(
        information=columns.T @ weighted,
        of_events=np.add.reduceat(weighted, np.searchsorted(event, np.arange(count))),
        weight=np.asarray(np.bincount(event, weight, count), dtype=float),
        product=weighted.T @ value,
        of_values=np.asarray(np.bincount(event, weight * value, count), dtype=float),
        square=float(weight @ value**2),
        log_weight=float(np.log(weight).sum()),
    )


def normal_equations(found: Sums, events: Vector) -> tuple[Matrix, Vector]:
    """(p, p) and (p,) with the common errors of each event integrated out.

    Args:
        found: sums of the reference.
        events: (m,) variance of each event's common error.
    """
    shared = found.of_events * (events / (1 + events * found.weight))[:, None]
    return found.information - found.of_events.T @ shared, found.product - shared.T @ found.of_values


def scatter(
    columns: Matrix,
    value: Vector,
    own: Vector,
    trust: Vector,
    event: Indices,
    doubt: Vector,
    precisions: Tensor,
    known: Quantity,
) -> Scatter:
    """Posterior means over the grid.

    Args:
        columns: (n, p)
        value: (n,) less what is expected with all coefficients zero.
        own: (n,) variance of each observation.
        trust: (n,) robust weight of each, at most 1.
        event: (n,) index of its event.
        doubt: (m,) factor of each event's variance, at least 1.
        precisions: (bends, p, p) of the coefficients beforehand, for each of BENDS.
        known: which quantity it is.
    """
    tried = np.outer((known.scatter * FACTORS) ** 2, doubt)
    prior = np.linalg.slogdet(precisions).logabsdet
    score = np.empty((OWN_FACTORS.size, FACTORS.size, BENDS.size))
    for i, factor in enumerate(OWN_FACTORS):
        weight = trust / (own + (factor * known.own_scatter) ** 2)
        found = sums(columns, value, weight, event, doubt.size)
        score[i] = 0.5 * prior + _evidence(found, tried, precisions) - 0.5 * (np.log(factor) / OWN_SPREAD) ** 2
    score -= 0.5 * (np.log(FACTORS) / SPREAD)[None, :, None] ** 2
    share = np.exp(score - score.max())
    share /= share.sum()
    return _mean(share, known)


def _mean(share: Tensor, known: Quantity) -> Scatter:
    """Means over the posterior of each; the freedom by matching mean and variance of a scaled inverse chi-square."""
    of_events, own, bend = share.sum(axis=(0, 2)), share.sum(axis=(1, 2)), share.sum(axis=(0, 1))
    variance = (known.scatter * FACTORS) ** 2
    mean = float(of_events @ variance)
    spread = float(of_events @ (variance - mean) ** 2) / mean**2
    return Scatter(
        events=float(np.sqrt(mean)),
        own=known.own_scatter * float(np.exp(own @ np.log(OWN_FACTORS))),
        bend=float(np.exp(bend @ np.log(BENDS))),
        freedom=float(np.clip(4 + 2 / max(spread, 1e-9), FEWEST_DEGREES, MOST_DEGREES)),
    )


def _evidence(found: Sums, events: Matrix, precisions: Tensor) -> Matrix:
    """(scatters, bends) log likelihood with coefficients and common errors integrated out, but for the prior's volume.

    Args:
        found: sums of the reference.
        events: (scatters, m) variance of each event's common error.
        precisions: (bends, p, p) of the coefficients beforehand.
    """
    share = events / (1 + events * found.weight)
    size = found.product.size
    outer = (found.of_events[:, :, None] * found.of_events[:, None, :]).reshape(-1, size**2)
    information = found.information - (share @ outer).reshape(-1, size, size)
    product = found.product - (share * found.of_values) @ found.of_events
    whole = information[:, None] + precisions
    solved = np.linalg.solve(whole, np.broadcast_to(product[:, None, :, None], (*whole.shape[:3], 1)))[..., 0]
    square = (found.square - share @ found.of_values**2)[:, None] - np.einsum("ijk,ik->ij", solved, product)
    volume = found.log_weight - np.log1p(events * found.weight).sum(axis=1)
    return np.asarray(0.5 * (volume[:, None] - np.linalg.slogdet(whole).logabsdet - square))
