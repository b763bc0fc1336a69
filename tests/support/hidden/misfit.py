"""How far do hidden effects move the layer's force beyond what other values of rubber, dashpot and damper can do?"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from scipy.optimize import minimize_scalar

from core.arrays import Matrix, Vector
from hidden.laws.layer import travelled

YIELDS = np.geomspace(3e-4, 5e-2, 12)
"""m, yield displacements that are tried before the best is refined."""
BETAS = (0.1, 0.9)
"""Range of the hysteresis' β."""
ROUNDS = 2
"""In which β and the yield displacement take turns."""


@njit
def _z(displacement, D_y, beta):  # noqa: ANN001, ANN202
    z = np.zeros(displacement.size)
    for i in range(1, z.size):
        z[i] = travelled(z[i - 1], (displacement[i] - displacement[i - 1]) / D_y, beta)
    return z


def misfit(displacement: Sequence[Vector], velocity: Sequence[Vector], force: Sequence[Vector]) -> float:
    """Error that the best elastic, viscous and hysteretic layer leaves, over the force; root mean square over events.

    Args:
        displacement: m, exact, of each event.
        velocity: m/s.
        force: N.
    """
    weight = [1 / np.linalg.norm(f) for f in force]
    F = np.concatenate([w * f for w, f in zip(weight, force, strict=True)])
    fixed = np.concatenate(
        [w * np.column_stack([u, v]) for w, u, v in zip(weight, displacement, velocity, strict=True)]
    )

    def left(log_yield: float, beta: float) -> float:
        z = np.concatenate([w * _z(u, np.exp(log_yield), beta) for w, u in zip(weight, displacement, strict=True)])
        return _left(np.column_stack([fixed, z]), F)

    yields = np.log(YIELDS)
    best = int(np.argmin([left(x, 0.5) for x in yields]))
    around = tuple(yields[[max(best - 1, 0), min(best + 1, yields.size - 1)]])
    log_yield, beta = yields[best], 0.5
    for _ in range(ROUNDS):
        beta = minimize_scalar(lambda x: left(log_yield, x), bounds=BETAS, method="bounded").x  # noqa: B023
        found = minimize_scalar(lambda x: left(x, beta), bounds=around, method="bounded")  # noqa: B023
        log_yield = found.x
    return float(np.sqrt(found.fun / len(force)))


def _left(columns: Matrix, F: Vector) -> float:
    """Sum of squares that least squares leaves."""
    gram, right = columns.T @ columns, columns.T @ F
    scale = np.sqrt(np.diag(gram))
    solved = np.linalg.lstsq(gram / np.outer(scale, scale), right / scale, rcond=None)[0]
    return float(np.sum((F - columns @ (solved / scale)) ** 2))
