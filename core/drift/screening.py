"""Screening: whether the latest events can raise an alarm at all, without the statistics of every event before them.

While no rule has come near its threshold, nothing is needed of the earlier events but their deviations as the rules saw
them, each the sum of its prediction and its clipped innovation. The covariance of the deviations is that of a few
common errors beside a diagonal, so that Woodbury's identity gives the statistics of one event for all onsets in a time
in proportion to their number. Whatever comes near a threshold is left to `core.drift.alarms`, which alone decides.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from core.arrays import Matrix, Vector
from core.drift.change_statistics import CLIP, DeviationSequence
from core.drift.quantities import Quantity
from core.drift.rules import PENDING_MARGIN, rules, steps

CAUTION = 0.01
"""Standard deviations below the threshold of a pending alarm from which on the full statistics decide. A choice: the
identity errs by less than a millionth of that."""
MOST_SCREENED = 20
"""New events up to which screening one after the other is faster than the full statistics. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class _Precision:
    """Products with the inverse of the covariance of n deviations."""

    times: Callable[[Vector], Vector]
    """(n,) product with a vector."""
    steps: Vector
    """(n,) square of the whitened step that begins at each onset."""
    ramps: Vector
    """(n,) the same of the ramp."""


def screened(known: Quantity, tested: DeviationSequence, before: Vector) -> Vector | None:
    """Deviations as the rules see them if no rule comes near its threshold at any new event; None if one does.

    Args:
        known: the quantity.
        tested: n deviations.
        before: (k,) deviations of the first k events as the rules saw them, when none of them raised an alarm.
    """
    count, seen = tested.deviation.size, before
    if count == 0 or count - before.size > MOST_SCREENED:
        return None
    for n in range(min(before.size, count - 1), count):
        precision, mean, std = (_of_all if tested.correlated is None else _of_correlated)(tested, n, seen[:n])
        new = mean + std * np.clip((tested.deviation[n] - mean) / std, -CLIP, CLIP)
        seen = np.append(seen[:n], new)
        if not _is_quiet(known, precision, seen, tested.freedom):
            return None
    return seen


def _is_quiet(known: Quantity, precision: _Precision, seen: Vector, freedom: float) -> bool:
    weighted = precision.times(seen)
    total = freedom + float(seen @ weighted)
    sums = _from_onset(weighted)
    for rule in rules(known):
        of_steps = rule.pattern is steps
        along, length = (sums, precision.steps) if of_steps else (_from_onset(sums), precision.ramps)
        explained = float((np.maximum(0.0, rule.sign * along) ** 2 / length).max())
        if not (length > 0).all() or not explained < total:
            return False
        root = np.sqrt((freedom + seen.size) * np.log(total / (total - explained)))
        if not root < rule.threshold + PENDING_MARGIN - CAUTION:
            return False
    return True


def _of_all(tested: DeviationSequence, n: int, seen: Vector) -> tuple[_Precision, float, float]:
    """Precision of the first n + 1 deviations, and the prediction of the last of them with its standard deviation."""
    common, own = tested.common[: n + 1], tested.own[: n + 1]
    scaled = common / own[:, None]
    information = np.eye(common.shape[1]) + scaled[:n].T @ common[:n]
    factor = cholesky(information, lower=True)
    mean = float(common[n] @ cho_solve((factor, True), scaled[:n].T @ seen))
    spread = solve_triangular(factor, common[n], lower=True)
    whole = cholesky(information + np.outer(scaled[n], common[n]), lower=True)

    def times(vector: Vector) -> Vector:
        return np.asarray((vector - common @ cho_solve((whole, True), scaled.T @ vector)) / own)

    def square(pattern: Matrix) -> Vector:
        return np.asarray((solve_triangular(whole, pattern.T, lower=True) ** 2).sum(axis=0))

    once, of_steps = _from_onset(1 / own), _from_onset(scaled)
    twice, of_ramps = _from_onset(once), _from_onset(of_steps)
    precision = _Precision(times, once - square(of_steps), 2 * _from_onset(twice) - twice - square(of_ramps))
    return precision, mean, float(np.sqrt(own[n] + spread @ spread))


def _of_correlated(tested: DeviationSequence, n: int, seen: Vector) -> tuple[_Precision, float, float]:
    """The same of deviations with any covariance, in a time that grows with the cube of their number."""
    covariance = tested.covariance[: n + 1, : n + 1]
    factor = cholesky(covariance, lower=True)
    inverse = cho_solve((factor, True), np.eye(n + 1))
    of_steps = _from_onset(_from_onset(inverse).T)
    of_ramps = _from_onset(_from_onset(of_steps).T)
    mean = float(factor[n, :n] @ solve_triangular(factor[:n, :n], seen, lower=True)) if n else 0.0
    return _Precision(inverse.__matmul__, np.diag(of_steps), np.diag(of_ramps)), mean, float(factor[n, n])


def _from_onset(values: Matrix | Vector) -> Matrix:
    """Sums along the first axis from each place to the end."""
    return np.asarray(np.cumsum(values[::-1], axis=0)[::-1])
