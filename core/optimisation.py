"""Steps of the method of Levenberg and Marquardt, and covariances, in parameters of any scale."""

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector

MOST_ATTEMPTS = 8
"""Attempts at a lower cost from one point. A choice: eight times HARDER is a factor of 2e7, beyond which steps
vanish."""
HARDER = 8.0
"""Factor on the damping after a step that did not lower the cost. A choice; Marquardt (1963) uses 10."""
MOST_INCREASES = 30
"""Tenfold increases of the damping until a matrix is positive definite; more would not change the step."""


class Costed(Protocol):
    """Point of a search."""

    @property
    def cost(self) -> float:
        """Value to minimise."""


Point = TypeVar("Point", bound=Costed)


def damped_step(normal: Matrix, descent: Vector, damping: float, scale: Vector | None = None) -> Vector | None:
    """Step to the minimum of a quadratic, shortened by damping relative to the diagonal (Marquardt, 1963).

    If the matrix is not positive definite, the damping is raised until it is.

    Args:
        normal: (k, k) Gauss and Newton's matrix, or the Hessian.
        descent: (k,) negative gradient.
        damping: added to the diagonal of the scaled matrix.
        scale: (k,) of the parameters' curvature; None for the square root of the matrix's diagonal.

    Returns:
        None if a parameter has no curvature, or no damping makes the matrix positive definite.
    """
    size = np.sqrt(np.diag(normal)) if scale is None else scale
    if not (np.all(size > 0) and np.isfinite(normal).all() and np.isfinite(descent).all()):
        return None
    scaled = normal / np.outer(size, size)
    for raised in damping * 10.0 ** np.arange(MOST_INCREASES):
        try:
            factor = linalg.cho_factor(scaled + raised * np.eye(size.size), check_finite=False)
        except linalg.LinAlgError:
            continue
        return np.asarray(linalg.cho_solve(factor, descent / size, check_finite=False) / size)
    return None


def improved(
    here: Point,
    step: Callable[[float], Vector | None],
    attempt: Callable[[Vector], Point],
    damping: float,
    *,
    easier: float,
    least: float,
) -> tuple[Point | None, float]:
    """A point of lower cost, None if there is none; and the damping for the next step.

    Args:
        here: where the search is.
        step: step by damping, as from `damped_step`.
        attempt: the point that a step leads to.
        damping: of the first attempt.
        easier: divisor of the damping after a success.
        least: smallest damping.
    """
    for _ in range(MOST_ATTEMPTS):
        change = step(damping)
        if change is None:
            break
        there = attempt(change)
        if there.cost < here.cost:
            return there, max(damping / easier, least)
        damping *= HARDER
    return None, damping


def scaled_inverse(normal: Matrix) -> Matrix:
    """(k, k) pseudo-inverse of a positive semidefinite matrix whose rows and columns have very different units."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    inverse: Matrix = np.linalg.pinv(normal * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
    return inverse
