"""Misfit: the part of hidden effects in the layer's force that rubber, dashpot and damper cannot imitate."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from scipy.optimize import minimize

from core.arrays import Matrix, Vector
from hidden.laws.layer import z_after_travel

YIELDS = np.geomspace(3e-4, 5e-2, 12)
"""m, yield displacements that are tried before the best is refined."""
ROUND = 0.99
"""Largest β: with 1 a damper that has yielded would never come back, and rounding make its z anything."""
FAR = 1e-7
"""Fraction of one event's sum of squares at which the search ends: 0.03 % of misfit."""


@njit
def _z(displacement, D_y, beta):  # noqa: ANN001, ANN202
    z = np.zeros(displacement.size)
    for i in range(1, z.size):
        z[i] = z_after_travel(z[i - 1], (displacement[i] - displacement[i - 1]) / D_y, beta)
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

    def left(at: Vector) -> float:
        """Sum of squares by the logarithm of the yield displacement, and β."""
        z = [w * _z(u, np.exp(at[0]), min(max(at[1], 0.0), ROUND)) for w, u in zip(weight, displacement, strict=True)]
        return _left(np.column_stack([fixed, np.concatenate(z)]), F)

    tried = [np.array([np.log(D_y), 0.5]) for D_y in YIELDS]
    begin = min(tried, key=left)
    simplex = begin + np.array([[0.0, 0.0], [0.3, 0.0], [0.0, 0.15]])
    found = minimize(
        left, begin, method="Nelder-Mead", options={"initial_simplex": simplex, "xatol": 1e-3, "fatol": FAR}
    )
    return float(np.sqrt(found.fun / len(force)))


def _left(columns: Matrix, F: Vector) -> float:
    """Sum of squares that least squares leaves."""
    gram, right = columns.T @ columns, columns.T @ F
    scale = np.sqrt(np.diag(gram))
    solved = np.linalg.lstsq(gram / np.outer(scale, scale), right / scale, rcond=None)[0]
    return float(np.sum((F - columns @ (solved / scale)) ** 2))
