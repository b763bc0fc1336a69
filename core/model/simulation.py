"""Seismic response of a shear building on its isolation layer to a ground motion."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np

from core.arrays import Matrix, Vector
from core.building import ShearBuilding, mass_matrix, stiffness_matrix
from core.effects import Laws
from core.errors import ModelError, RecordError
from core.laws.compilation import bound, cached, inlined
from core.model.isolator import Conditions, Isolator, packed
from core.model.program import MOST_CACHED, force_digest, force_program

SUBSTEPS = 3
"""Smallest number of steps per sample: the force of the paper's building at 100 Hz then has an error of 1e-5 of its
norm."""
LARGEST_STEP = 1.0
"""rad, largest phase of the fastest mode per step, the base slab free to move; the method is stable up to 2.8."""


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Computed motion and force at the ground motion's samples, as sensors without error would record them."""

    isolator_displacement: Vector
    """(n,) m, x_b, of the base slab relative to the ground."""
    isolator_velocity: Vector
    """(n,) m/s."""
    force: Vector
    """(n,) N, restoring force of the isolation layer."""
    base_acceleration: Vector
    """(n,) m/s², absolute."""
    floor_acceleration: Matrix
    """(floors, n) m/s², absolute, from the lowest floor to the roof."""
    floor_displacement: Matrix
    """(floors, n) m, relative to the base slab."""


def simulate(
    building: ShearBuilding,
    isolator: Isolator,
    ground_acceleration: Vector,
    rate: float,
    *,
    conditions: Conditions | None = None,
    substeps: int | None = None,
) -> Response:
    """Response from rest, by the classical Runge-Kutta method with the ground acceleration linear between samples.

    Solves eq 1 of the paper with the isolation layer's law in place of k_b, c_b and f_nl. The order is four where the
    laws are smooth and two at kinks, such as those of Bouc-Wen where the velocity changes sign.

    Args:
        building: the building above the isolators.
        isolator: the isolation layer.
        ground_acceleration: (n,) m/s².
        rate: Hz.
        conditions: None for Conditions.usual: motion in one direction, dead load, 20 °C.
        substeps: per sample; None for SUBSTEPS, or more if the highest mode needs more.

    Raises:
        RecordError: the ground acceleration has gaps.
        ModelError: the response diverged: the steps are too long for the layer's stiffness.
    """
    if ground_acceleration.ndim != 1 or not np.isfinite(ground_acceleration).all():
        raise RecordError("the ground acceleration must be one series without gaps; fill or cut them first")
    count = ground_acceleration.size
    given = (conditions or Conditions.usual(count, rate)).rows
    if given.shape[0] != count:
        raise RecordError(f"conditions are given for {given.shape[0]} samples, the ground acceleration has {count}")
    model = packed(isolator)
    displacement, velocity, force, acceleration = _kernel(model.laws)(
        np.append(building.base_mass, building.floor_mass),
        building.storey_stiffness,
        building.damping_coefficient * building.storey_stiffness,
        np.column_stack([ground_acceleration, given]),
        1 / rate,
        substeps or _substeps(building, rate),
        model.opcode,
        model.at_p,
        model.at_x,
        model.p,
        model.states,
    )
    if not np.isfinite(force).all():
        raise ModelError("the response grew beyond all bounds; try more substeps or a softer layer")
    return Response(
        isolator_displacement=displacement[0],
        isolator_velocity=velocity,
        force=force,
        base_acceleration=acceleration[0],
        floor_acceleration=acceleration[1:],
        floor_displacement=displacement[1:] - displacement[0],
    )


def _substeps(building: ShearBuilding, rate: float) -> int:
    # On the layer the base slab is free to move, which makes the highest mode faster than any fixed-base mode.
    root = np.sqrt(np.diag(mass_matrix(building)))
    free = stiffness_matrix(building, layer_stiffness=0.0) / np.outer(root, root)
    highest = float(np.sqrt(np.linalg.eigvalsh(free)[-1]))
    # Above critical damping, a mode decays at a rate of up to α ω².
    fastest = highest * max(1.0, building.damping_coefficient * highest)
    return max(SUBSTEPS, ceil(fastest / rate / LARGEST_STEP))


@lru_cache(MOST_CACHED)
def _kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Integration loop for these effects, compiled at its first call."""
    bound_rates = inlined(bound(_rates, layer_force=force_program(laws)))
    return cached(bound(_integrate, rates=bound_rates), force_digest(laws))


layer_force: Any = None
rates: Any = None
"""Placeholders of the functions that are bound before compilation."""


def _rates(y, dy, given, n, mobility, stiffness, damping, opcode, at_p, at_x, p):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill dy with the rates of y: displacements and velocities from the base slab up, then states of the layer.

    Motion is relative to the ground. Returns the layer's force.
    """
    ground, u_cross, v_cross, axial_load = given[0], given[1], given[2], given[3]
    temperature, time = given[4], given[5]
    force, inertance = layer_force(
        y[0], y[n], u_cross, v_cross, axial_load, temperature, time, opcode, at_p, at_x, p, y, dy
    )
    below = force
    for i in range(n - 1):
        above = stiffness[i] * (y[i + 1] - y[i]) + damping[i] * (y[n + i + 1] - y[n + i])
        dy[i] = y[n + i]
        dy[n + i] = (above - below) * mobility[i] - ground
        below = above
    dy[n - 1] = y[2 * n - 1]
    dy[2 * n - 1] = -below * mobility[n - 1] - ground
    if inertance != 0:  # it resists the slab's acceleration relative to the ground
        dy[n] /= 1 + inertance * mobility[0]
        force += inertance * dy[n]
    return force


def _integrate(mass, stiffness, damping, given, dt, substeps, opcode, at_p, at_x, p, states):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, count, h, mobility = mass.size, given.shape[0], dt / substeps, 1 / mass
    ahead, weight = (0.0, h / 2, h / 2, h), (h / 6, h / 3, h / 3, h / 6)
    at_x = at_x + 2 * n
    y, dy, stage = np.zeros(2 * n + states), np.zeros(2 * n + states), np.zeros(2 * n + states)
    end, now, slope = np.zeros_like(y), np.zeros(given.shape[1]), np.zeros(given.shape[1])
    displacement, velocity = np.empty((n, count)), np.empty(count)
    acceleration, force = np.empty((n, count)), np.empty(count)
    for i in range(count):
        for j in range(now.size):
            slope[j] = (given[min(i + 1, count - 1), j] - given[i, j]) / dt
        for s in range(substeps):
            for j in range(y.size):
                end[j] = y[j]
            for k in range(4):
                t = s * h + ahead[k]
                for j in range(now.size):
                    now[j] = given[i, j] + t * slope[j]
                for j in range(y.size):
                    stage[j] = y[j] + ahead[k] * dy[j]
                f = rates(stage, dy, now, n, mobility, stiffness, damping, opcode, at_p, at_x, p)
                if s == 0 and k == 0:
                    force[i], velocity[i] = f, y[n]
                    for j in range(n):
                        displacement[j, i], acceleration[j, i] = y[j], dy[n + j] + now[0]
                for j in range(y.size):
                    end[j] += weight[k] * dy[j]
            for j in range(y.size):
                y[j] = end[j]
    return displacement, velocity, force, acceleration
