"""Damped steps of least squares, bounded least squares and scaled inverses, for parameters of very different units.

Fits of models and of modes take their Levenberg-Marquardt steps here; each has its own test of whether a step succeeds.
The calibration of the frame solves the same equations itself: another order of its products changes the last digits,
and a choice between hypotheses of nearly equal cost could change with them.
"""

from collections.abc import Sequence

import numpy as np
from scipy import linalg
from scipy.optimize import lsq_linear

from core.arrays import Matrix, Vector

MOST_INCREASES = 30
"""Tenfold increases of the damping until a matrix is positive definite; more would not change the step."""
DEGENERATE = 1e-9
"""Smallest eigenvalue of a matrix with ones on its diagonal, relative to the largest, along which data determine
anything."""
SMALLEST = 1e-12
"""The same within bounds, where smaller eigenvalues are raised to it: bounds keep the amplitudes small."""
TOLERANCE = 1e-12
"""Relative reduction of the cost below which bounded least squares ends."""
MOST_CHANGES = 20
"""Largest number of changes of the active bounds, per amplitude."""


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


def bounded_least_squares(rows: Matrix, target: Vector, bounds: Sequence[tuple[float, float]]) -> Vector:
    """(k,) amplitudes x of least |target − x rows| within bounds; Stark and Parker's (1995) BVLS where they matter.

    Where the amplitudes without bounds are within them, they are the answer. What other rows can do all of gets the
    least amplitudes.

    Args:
        rows: (k, m).
        target: (m,)
        bounds: (k,) smallest and largest amplitude.
    """
    scale = np.linalg.norm(rows, axis=1)
    free = np.flatnonzero(scale > 0)
    low, high = np.array(bounds, dtype=float).reshape(-1, 2).T
    best = np.clip(np.zeros(len(rows)), low, high)
    if not free.size:
        return best
    alike = rows[free] / scale[free, None]
    values, vectors = linalg.eigh(alike @ alike.T)
    kept = values > DEGENERATE * values[-1]
    along = vectors.T @ (alike @ target)
    inside = vectors[:, kept] @ (along[kept] / values[kept]) / scale[free]
    if np.all((low[free] <= inside) & (inside <= high[free])):
        best[free] = inside
        return best
    ends = low[free] * scale[free], high[free] * scale[free]
    size = float(np.linalg.norm(along)) or 1.0
    roots = np.sqrt(np.maximum(values, SMALLEST * values[-1]))
    reduced, wanted = roots[:, None] * vectors.T, along / roots / size
    found = lsq_linear(
        reduced,
        wanted,
        (ends[0] / size, ends[1] / size),
        method="bvls",
        tol=TOLERANCE,
        max_iter=MOST_CHANGES * free.size,
    )
    best[free] = np.clip(found.x * size / scale[free], low[free], high[free])
    best[free[found.active_mask < 0]] = low[free[found.active_mask < 0]]
    best[free[found.active_mask > 0]] = high[free[found.active_mask > 0]]
    return best
