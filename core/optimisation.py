"""Minimisation: Levenberg-Marquardt steps, bounded least squares and scaled inverses, for very different units.

Fits of models and of modes and the calibration of the frame descend by `lower_point`: one way of computing a trial
step, of accepting it and of changing the damping. `minimised` repeats it until a stopping rule is met. A model's fit
repeats it itself, because the searches of several candidates take turns (core.diagnosis.candidate_search).

Two comparisons of sensors do without it. core.sensors.floor_agreement fits a few unknowns per floor, with derivatives
by differences, and uses SciPy's. The delays of core.sensors.layer_agreement and core.sensors.clock are shifted out of
the records and estimated again from what is left: with errors in all variables these equations are no gradient of a
cost.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeAlias, TypeVar

import numpy as np
import scipy
from scipy import linalg

from core.arrays import Matrix, Vector

MOST_INCREASES = 30
"""Tenfold increases of the damping until a matrix is positive definite; more would not change the step."""
DEGENERATE = 1e-9
"""Smallest eigenvalue of a matrix with ones on its diagonal, relative to the largest, along which data determine
anything. A choice."""
SMALLEST = 1e-12
"""The same within bounds, where smaller eigenvalues are raised to it: bounds keep the amplitudes small."""
TOLERANCE = 1e-12
"""Relative reduction of the cost below which bounded least squares ends. A choice."""
MOST_CHANGES = 20
"""Largest number of changes of the active bounds, per amplitude. A choice."""


class Point(Protocol):
    """Values of the parameters, with all that was computed at them."""

    @property
    def cost(self) -> float:
        """Cost to be minimised: infinite where it cannot be computed."""
        ...


P = TypeVar("P", bound=Point)


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """Quadratic approximation of a cost about a point."""

    normal: Matrix
    """(k, k) Gauss-Newton matrix, or the Hessian."""
    descent: Vector
    """(k,) negative gradient."""
    scale: Vector | None = None
    """(k,) square root of the curvature by each parameter; None for that of the matrix's diagonal."""

    def step(self, damping: float) -> Vector | None:
        """(k,) step to the minimum, shortened by damping; see `damped_step`."""
        return damped_step(self.normal, self.descent, damping, self.scale)


@dataclass(frozen=True, slots=True)
class FactorDamping:
    """Damping that a step divides by one factor and a failed trial multiplies by another (Marquardt 1963)."""

    value: float
    divisor: float
    multiplier: float
    smallest: float

    def after_step(self, gained: float, expected: float) -> "FactorDamping":
        """Damping for the step after one that lowered the cost."""
        return replace(self, value=max(self.value / self.divisor, self.smallest))

    def after_failure(self) -> "FactorDamping":
        """Damping for the trial after one that did not."""
        return replace(self, value=self.value * self.multiplier)


@dataclass(frozen=True, slots=True)
class GainRatioDamping:
    """Damping that follows the ratio of achieved to expected reduction (Nielsen 1999).

    One step divides it by 10 at most, where Nielsen's divides it by 3. Not tuned.
    """

    value: float
    multiplier: float = 2.0
    """Factor after the next failed trial; it doubles with every failure in a row."""

    def after_step(self, gained: float, expected: float) -> "GainRatioDamping":
        """Damping for the step after one that lowered the cost."""
        return GainRatioDamping(self.value * max(1 / 10, 1 - (2 * (gained / expected) - 1) ** 3))

    def after_failure(self) -> "GainRatioDamping":
        """Damping for the trial after one that did not."""
        return GainRatioDamping(self.value * self.multiplier, 2 * self.multiplier)


Damping: TypeAlias = FactorDamping | GainRatioDamping


@dataclass(frozen=True, slots=True, eq=False)
class Step(Generic[P]):
    """Result of the trials of one Levenberg-Marquardt step."""

    start: P
    point: P
    """Point of lower cost; the start if no trial gave one."""
    damping: Damping
    """Damping for the next step."""
    gained: float
    """Reduction of the cost; 0 without a point of lower cost."""
    expected: float
    """Reduction by the gradient alone along the last trial."""


def lower_point(
    start: P, quadratic: Quadratic, moved: Callable[[Vector], P], damping: Damping, most_trials: int
) -> Step[P] | None:
    """Levenberg-Marquardt step: damping grows until a trial lowers the cost. None if no step can be computed.

    Args:
        start: the point to improve.
        quadratic: approximation about it.
        moved: point at the start's parameters plus a (k,) step, perhaps shortened to what the parameters allow.
        damping: of the first trial.
        most_trials: largest number of trials.
    """
    expected = 0.0
    for _ in range(most_trials):
        change = quadratic.step(damping.value)
        if change is None:
            return None
        expected = float(quadratic.descent @ change)
        trial = moved(change)
        if trial.cost < start.cost:
            gained = start.cost - trial.cost
            return Step(start, trial, damping.after_step(gained, expected), gained, expected)
        damping = damping.after_failure()
    return Step(start, start, damping, 0.0, expected)


def minimised(
    start: P,
    step: Callable[[P, Damping], Step[P] | None],
    has_settled: Callable[[P, Step[P]], bool],
    damping: Damping,
    most_steps: int,
) -> tuple[P, bool]:
    """Point at which a cost has its minimum, and whether the stopping rule was met.

    Args:
        start: the first point.
        step: by `lower_point` from a point with a damping. It may first improve the point by other means.
        has_settled: stopping rule, from the point before a step and that step.
        damping: of the first trial.
        most_steps: largest number of steps.
    """
    point = start
    for _ in range(most_steps):
        latest = step(point, damping)
        if latest is None:
            break
        if has_settled(point, latest):
            return latest.point, True
        point, damping = latest.point, latest.damping
    return point, False


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
    if not descent.size:
        return descent
    size = np.sqrt(np.diag(normal)) if scale is None else scale
    if not (np.all(size > 0) and np.isfinite(normal).all() and np.isfinite(descent).all()):
        return None
    scaled = normal / np.outer(size, size)
    diagonal = np.diag_indices(size.size)
    for increase in range(MOST_INCREASES):
        matrix = scaled.copy()
        matrix[diagonal] += damping * 10.0**increase
        # scipy.linalg.cho_factor and cho_solve take longer to examine small matrices than to solve them
        _, step, status = linalg.lapack.dposv(matrix, descent / size)
        if status == 0:
            return np.asarray(step / size)
    return None


def scaled_inverse(normal: Matrix) -> Matrix:
    """(k, k) pseudo-inverse of a positive semidefinite matrix whose rows and columns have very different units."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    inverse: Matrix = np.linalg.pinv(normal * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
    return inverse


def bounded_least_squares(rows: Matrix, target: Vector, bounds: Sequence[tuple[float, float]]) -> Vector:
    """(k,) amplitudes x of least |target − x rows| within bounds; Stark and Parker's (1995) BVLS where they matter.

    Where the amplitudes without bounds are within them, they are the answer. Among linearly dependent rows the
    answer is that of least amplitudes.

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
    solution = scipy.optimize.lsq_linear(
        reduced,
        wanted,
        (ends[0] / size, ends[1] / size),
        method="bvls",
        tol=TOLERANCE,
        max_iter=MOST_CHANGES * free.size,
    )
    best[free] = np.clip(solution.x * size / scale[free], low[free], high[free])
    best[free[solution.active_mask < 0]] = low[free[solution.active_mask < 0]]
    best[free[solution.active_mask > 0]] = high[free[solution.active_mask > 0]]
    return best
