"""Damped steps of least squares and scaled inverses, for parameters of very different units."""

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector

MOST_INCREASES = 30
"""Tenfold increases of the damping until a matrix is positive definite; more would not change the step."""


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


def scaled_inverse(normal: Matrix) -> Matrix:
    """(k, k) pseudo-inverse of a positive semidefinite matrix whose rows and columns have very different units."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    inverse: Matrix = np.linalg.pinv(normal * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
    return inverse
