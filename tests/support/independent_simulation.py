"""Any linear superstructure on the paper's isolation layer, integrated in another way than core.model.simulation does.

The linear part is discretised exactly, inputs linear over a step (Van Loan, 1978); the Bouc-Wen state follows its own
closed form between reversals (Wen, 1976, n = 1), so that only the coupling of the two is approximated.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import expm

from core.arrays import Matrix, Vector
from core.paper import ISOLATOR

SUBSTEPS = 16
"""Per sample: at 100 Hz the force is then within 1e-5 of its norm of the limit."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearSuperstructure:
    """Masses, and any stiffness and damping between the floors and a base slab that does not turn."""

    base_mass: float
    """kg."""
    floor_mass: Vector
    """(floors,) kg."""
    stiffness: Matrix
    """(floors, floors) N/m, on a fixed base."""
    damping: Matrix
    """(floors, floors) N s/m, on a fixed base: all dashpots lie between floors, or between a floor and the slab."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Error-free response."""

    acceleration: Matrix
    """(1 + floors, n) m/s², absolute, the base slab first."""
    force: Vector
    """(n,) N, of the isolation layer."""
    displacement: Vector
    """(n,) m, of the isolation layer."""
    velocity: Vector
    """(n,) m/s, of the isolation layer."""


def independent_response(
    building: LinearSuperstructure, ground_acceleration: Vector, rate: float, substeps: int = SUBSTEPS
) -> Motion:
    """Response from rest to a ground acceleration, linear between samples, on core.paper's isolation layer."""
    law = ISOLATOR.effects["bouc_wen"]
    mass = np.append(building.base_mass, building.floor_mass)
    system, inputs = _state_space(building, mass)
    step, held, rising = _discretised(system, inputs, 1 / (rate * substeps))
    states, z = _integrate(
        ground_acceleration, substeps, step, held, rising, law["A"], law["beta"], law["gamma"], law["D_y"]
    )
    n = mass.size
    relative = (states @ system.T + np.column_stack([ground_acceleration, z]) @ inputs.T)[:, n:]
    acceleration = (relative + ground_acceleration[:, None]).T
    displacement, velocity = states[:, 0].copy(), states[:, n].copy()
    layer = ISOLATOR.effects["elastic"]["k_b"] * displacement + ISOLATOR.effects["viscous"]["c_b"] * velocity
    return Motion(np.ascontiguousarray(acceleration), layer + law["F_y"] * z, displacement, velocity)


def _state_space(building: LinearSuperstructure, mass: Vector) -> tuple[Matrix, Matrix]:
    """x' = A x + B [ground acceleration, z] for x = [displacements; velocities] relative to the ground, base first."""
    n = mass.size
    K = _with_base(building.stiffness, ISOLATOR.effects["elastic"]["k_b"])
    C = _with_base(building.damping, ISOLATOR.effects["viscous"]["c_b"])
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:] = -np.hstack([K, C]) / mass[:, None]
    B = np.zeros((2 * n, 2))
    B[n:, 0] = -1.0
    B[n, 1] = -ISOLATOR.effects["bouc_wen"]["F_y"] / mass[0]
    return A, B


def _with_base(fixed: Matrix, layer: float) -> Matrix:
    """The matrix of all levels, base slab first: what the floors push, the slab pushes back."""
    coupling = -fixed.sum(axis=1)
    return np.block([[np.atleast_2d(layer - coupling.sum()), coupling[None]], [coupling[:, None], fixed]])


def _discretised(A: Matrix, B: Matrix, h: float) -> tuple[Matrix, Matrix, Matrix]:
    """x₁ = Φ x₀ + Γ₀ u₀ + Γ₁ (u₁ − u₀), exact for u linear over the step h."""
    n, m = B.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m], block[n : n + m, n + m :] = A * h, B * h, np.eye(m)
    whole = expm(block)
    return tuple(np.ascontiguousarray(whole[:n, part]) for part in (np.s_[:n], np.s_[n : n + m], np.s_[n + m :]))  # type: ignore[return-value]


@njit
def _turned(z, travel, A, beta, gamma):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """z after a monotonic travel, in yield displacements: dw/dξ = A − γ w − β |w| for w = z · sign(travel)."""
    sign, left = (1.0, travel) if travel >= 0 else (-1.0, -travel)
    w = sign * z
    if w < 0:
        falling = gamma - beta
        reach = w * np.exp(-falling * left) + A * (-np.expm1(-falling * left)) / falling
        if reach <= 0:
            return sign * reach
        left -= np.log1p(-falling * w / A) / falling
        w = 0.0
    rising = gamma + beta
    return sign * (w * np.exp(-rising * left) + A * (-np.expm1(-rising * left)) / rising)


@njit(cache=True)
def _integrate(ground, substeps, step, held, rising, A, beta, gamma, yielding):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, count = step.shape[0], ground.size
    x, ahead, z, columns = np.zeros(n), np.zeros(n), 0.0, step.T.copy()
    states, histories = np.zeros((count, n)), np.zeros(count)
    for i in range(count - 1):
        slope = (ground[i + 1] - ground[i]) / substeps
        for s in range(substeps):
            a = ground[i] + s * slope
            for row in range(n):
                ahead[row] = held[row, 0] * a + held[row, 1] * z + rising[row, 0] * slope
            for column in range(n):  # in loops: with products of arrays the whole takes twice as long
                for row in range(n):
                    ahead[row] += columns[column, row] * x[column]
            after = z
            for _ in range(4):  # a contraction by about 1e-4 a turn
                after = _turned(z, (ahead[0] + rising[0, 1] * (after - z) - x[0]) / yielding, A, beta, gamma)
            for row in range(n):
                x[row] = ahead[row] + rising[row, 1] * (after - z)
            z = after
        states[i + 1], histories[i + 1] = x, z
    return states, histories
