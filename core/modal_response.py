"""Response to a ground motion of a building that is known by its superstructure's fixed-base modes."""

from functools import cache
from math import ceil
from typing import Any

import numpy as np
from scipy import linalg

from core.arrays import Vector
from core.building import FixedBaseModes
from core.compiled import bound, jitted, kept
from core.errors import ModelError, RecordError
from core.isolator import Conditions, Isolator, packed
from core.program import force_digest, force_program
from core.simulation import LARGEST_STEP, SUBSTEPS, Response


def respond(
    modes: FixedBaseModes,
    base_mass: float,
    isolator: Isolator,
    ground_acceleration: Vector,
    rate: float,
    conditions: Conditions,
    states: Vector | None = None,
) -> Response:
    """Response from rest in the paper's hybrid coordinates (eq 7), by the classical Runge-Kutta method.

    Any superstructure with classical damping is held by its modes, a frame whose joints and base give way as well as a
    shear building.

    Args:
        modes: all of the superstructure's, as many as it has floors.
        base_mass: kg, of the slab above the isolators.
        isolator: the isolation layer.
        ground_acceleration: (n,) m/s², linear between samples.
        rate: Hz.
        conditions: what else acts on the layer.
        states: (m,) of the layer at the first sample, in the order of core.isolator.state_names; None for zero.

    Raises:
        RecordError: the ground acceleration has gaps.
        ModelError: the response grew beyond all bounds: the steps are too long for the layer's stiffness.
    """
    if ground_acceleration.ndim != 1 or not np.isfinite(ground_acceleration).all():
        raise RecordError("the ground acceleration must be one series without gaps; fill or cut them first")
    # Φᵀ M r of modes with Φᵀ M Φ = I
    participation = np.asarray(linalg.solve(modes.shape, np.ones(modes.shape.shape[0])))
    model = packed(isolator)
    coordinates, velocity, accelerations, force = _kernel()(
        base_mass,
        participation,
        modes.angular_frequency**2,
        2 * modes.damping_ratio * modes.angular_frequency,
        np.column_stack([ground_acceleration, conditions.rows]),
        1 / rate,
        _substeps(modes, participation, base_mass, rate),
        model.opcode,
        model.at_p,
        model.at_x,
        model.p,
        np.zeros(model.states) if states is None else states,
    )
    if not np.isfinite(force).all():
        raise ModelError("the response grew beyond all bounds; a softer layer would do")
    return Response(
        isolator_displacement=coordinates[0],
        isolator_velocity=velocity,
        force=force,
        base_acceleration=accelerations[0],
        floor_acceleration=accelerations[0] + modes.shape @ accelerations[1:],
        floor_displacement=modes.shape @ coordinates[1:],
    )


def _substeps(modes: FixedBaseModes, participation: Vector, base_mass: float, rate: float) -> int:
    # on the layer the base slab moves, and that makes the highest mode faster than any fixed-base one
    squared, load = modes.angular_frequency**2, participation / np.sqrt(base_mass)
    free = np.diag(squared) + np.outer(modes.angular_frequency * load, modes.angular_frequency * load)
    highest = float(np.sqrt(np.linalg.eigvalsh(free)[-1]))
    fastest = highest * max(1.0, 2 * float(modes.damping_ratio.max()))
    return max(SUBSTEPS, ceil(fastest / rate / LARGEST_STEP))


@cache
def _kernel() -> Any:  # noqa: ANN401  numba's functions have no type
    """The integration loop over all effects there are, compiled when first called."""
    bound_rates = jitted(bound(_rates, layer_force=force_program()))
    return kept(bound(_integrate, rates=bound_rates), force_digest())


layer_force: Any = None
rates: Any = None
"""Bound when compiled."""


def _rates(y, dy, given, n, base_mass, load, squared, damping, opcode, at_p, at_x, p):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill dy with the rates of y: the slab's displacement, the modal ones, their velocities, the layer's states.

    Returns the layer's force.
    """
    force, inertance = layer_force(
        y[0], y[n], given[1], given[2], given[3], given[4], given[5], opcode, at_p, at_x, p, y, dy
    )
    above = 0.0
    for i in range(n - 1):
        dy[n + 1 + i] = -squared[i] * y[1 + i] - damping[i] * y[n + 1 + i]
        above += load[i] * dy[n + 1 + i]
    slab = ((-force - above) / base_mass - given[0]) / (1 + inertance / base_mass)
    for i in range(n - 1):
        dy[n + 1 + i] -= load[i] * (slab + given[0])
        dy[1 + i] = y[n + 1 + i]
    dy[0], dy[n] = y[n], slab
    return force + inertance * slab


def _integrate(base_mass, load, squared, damping, given, dt, substeps, opcode, at_p, at_x, p, states):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, count, h = 1 + load.size, given.shape[0], dt / substeps
    ahead, weight = (0.0, h / 2, h / 2, h), (h / 6, h / 3, h / 3, h / 6)
    at_x = at_x + 2 * n
    y, dy = np.zeros(2 * n + states.size), np.zeros(2 * n + states.size)
    y[2 * n :] = states
    coordinates, velocity = np.empty((n, count)), np.empty(count)
    accelerations, force = np.empty((n, count)), np.empty(count)
    for i in range(count):
        slope = (given[min(i + 1, count - 1)] - given[i]) / dt
        for s in range(substeps):
            end = y.copy()
            for k in range(4):
                t = s * h + ahead[k]
                now = given[i] + t * slope
                f = rates(y + ahead[k] * dy, dy, now, n, base_mass, load, squared, damping, opcode, at_p, at_x, p)
                if s == 0 and k == 0:
                    force[i], velocity[i], coordinates[:, i] = f, y[n], y[:n]
                    accelerations[0, i] = dy[n] + now[0]
                    accelerations[1:, i] = dy[n + 1 : 2 * n]
                end += weight[k] * dy
            y = end
    return coordinates, velocity, accelerations, force
