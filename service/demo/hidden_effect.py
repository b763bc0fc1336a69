"""A building whose isolation layer does more than its model: rubber that hardens exponentially.

No effect of the library has this form. It is integrated here by itself: the service gets records, and nothing of this
file.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from core.arrays import Vector
from core.building import damping_matrix, mass_matrix, stiffness_matrix
from core.code_generation.compilation import bound, cached
from core.model.simulation import Response
from core.paper import BUILDING, ISOLATOR
from service.demo.site import RATE


@dataclass(frozen=True, slots=True)
class Hardening:
    """A force of stiffness · (length sinh(u / length) - u)."""

    stiffness: float
    """N/m, stiffness added to the rubber's at 1.3 lengths, where cosh(u / length) is 2."""
    length: float
    """m."""


RUBBER = Hardening(200e6, 0.15)
"""Adds 40 % to the rubber's stiffness at 200 mm, a shear strain of 100 %."""
SUBSTEPS = 10
"""Steps per sample, 1 ms each: the damper yields within 1.5 ms when the layer moves at 1 m/s."""


def response(ground_acceleration: Vector, hardening: Hardening = RUBBER) -> Response:
    """Error-free records from rest, by the classical Runge-Kutta method.

    Apart from the hardening the layer is the paper's (eq 22): k_b u + c_b v + F_y z.

    Args:
        ground_acceleration: (n,) m/s² at RATE.
        hardening: of the rubber.
    """
    layer = {name: value for effect in ISOLATOR.effects.values() for name, value in effect.items()}
    k_b, c_b, damper = layer["k_b"], layer["c_b"], tuple(layer[name] for name in ("F_y", "D_y", "A", "beta", "gamma"))
    springs = np.hstack([stiffness_matrix(BUILDING, k_b), damping_matrix(BUILDING, c_b)])
    linear = -np.linalg.solve(mass_matrix(BUILDING), springs)
    moved, speed, beyond = _kernel()(
        linear,
        1 / BUILDING.base_mass,
        damper,
        (hardening.stiffness, hardening.length),
        ground_acceleration,
        1 / RATE,
        SUBSTEPS,
    )
    acceleration = linear @ np.vstack([moved, speed])
    acceleration[-1] -= beyond / BUILDING.base_mass
    return Response(
        isolator_displacement=moved[-1],
        isolator_velocity=speed[-1],
        force=k_b * moved[-1] + c_b * speed[-1] + beyond,
        base_acceleration=acceleration[-1],
        floor_acceleration=acceleration[:-1],
        floor_displacement=moved[:-1] - moved[-1],
    )


@cache
def _kernel() -> Any:  # noqa: ANN401  numba's functions have no type
    return cached(bound(_integrate), "alone")


def _integrate(linear, mobility, damper, hardening, ground, dt, substeps):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Displacements and velocities (floors and the base slab last, n); the layer's force (n,) beyond its linear one."""
    F_y, D_y, A, beta, gamma = damper
    k_h, length = hardening
    n, count, h = linear.shape[0], ground.size, dt / substeps
    ahead, weight = (0.0, 0.5, 0.5, 1.0), (h / 6, h / 3, h / 3, h / 6)
    y, dy = np.zeros(2 * n + 1), np.zeros(2 * n + 1)
    moved, speed, beyond = np.empty((n, count)), np.empty((n, count)), np.empty(count)
    for i in range(count):
        slope = (ground[min(i + 1, count - 1)] - ground[i]) / dt
        for s in range(substeps):
            end = y.copy()
            for k in range(4):
                stage = y + ahead[k] * h * dy
                a = ground[i] + slope * (s + ahead[k]) * h
                u, v, z = stage[n - 1], stage[2 * n - 1], stage[2 * n]
                force = F_y * z + k_h * (length * np.sinh(u / length) - u)
                dy[:n] = stage[n : 2 * n]
                for j in range(n):
                    dy[n + j] = -a
                    for m in range(2 * n):
                        dy[n + j] += linear[j, m] * stage[m]
                dy[2 * n - 1] -= force * mobility
                dy[2 * n] = (A * v - beta * abs(z) * v - gamma * z * abs(v)) / D_y
                if s == 0 and k == 0:
                    moved[:, i], speed[:, i], beyond[i] = y[:n], y[n : 2 * n], force
                end += weight[k] * dy
            y = end
    return moved, speed, beyond
