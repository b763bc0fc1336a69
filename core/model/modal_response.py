"""Seismic response of an isolated building whose superstructure is given by its fixed-base modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np
from scipy import linalg

from core.arrays import Vector
from core.building import FixedBaseModes
from core.effects import Laws
from core.errors import ModelError, RecordError
from core.laws.compilation import bound, cached, jitted
from core.model.isolator import Conditions, Isolator, packed
from core.model.program import MOST_CACHED, force_digest, force_program
from core.model.simulation import LARGEST_STEP, SUBSTEPS, Response


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """Input of one horizontal direction."""

    modes: FixedBaseModes
    """All modes of the superstructure, as many as it has floors."""
    ground_acceleration: Vector
    """(n,) m/s², linear between samples."""
    conditions: Conditions
    """Conditions of the layer, with its motion in the other direction unless that direction is computed too."""
    states: Vector | None = None
    """(m,) states of the layer at the first sample, in the order of core.model.isolator.state_names; None for zero."""


def respond(axis: Axis, base_mass: float, isolator: Isolator, rate: float) -> Response:
    """Response from rest in one direction; see respond_together."""
    (response,) = respond_together([axis], base_mass, isolator, rate)
    return response


def respond_together(axes: Sequence[Axis], base_mass: float, isolator: Isolator, rate: float) -> tuple[Response, ...]:
    """Response from rest in the paper's hybrid coordinates (eq 7), by the classical Runge-Kutta method.

    Modes describe any superstructure with classical damping: a frame with flexible joints and base as well as a shear
    building. Two directions are coupled by the isolation layer, which has the computed motion of both; superstructures
    do not couple them.

    Args:
        axes: one direction, or both of the same earthquake.
        base_mass: kg, of the base slab.
        isolator: the isolation layer, the same in each direction.
        rate: Hz.

    Raises:
        RecordError: the ground acceleration has gaps.
        ModelError: the response diverged: the steps are too long for the layer's stiffness.
    """
    if any(one.ground_acceleration.ndim != 1 or not np.isfinite(one.ground_acceleration).all() for one in axes):
        raise RecordError("the ground acceleration must be one series without gaps; fill or cut them first")
    loads = [_participation(one.modes) for one in axes]
    model = packed(isolator)
    coordinates, velocity, accelerations, force = _kernel(model.laws)(
        base_mass,
        np.array(loads),
        np.array([one.modes.angular_frequency**2 for one in axes]),
        np.array([2 * one.modes.damping_ratio * one.modes.angular_frequency for one in axes]),
        np.array([np.column_stack([one.ground_acceleration, one.conditions.rows]) for one in axes]),
        1 / rate,
        max(_substeps(one.modes, load, base_mass, rate) for one, load in zip(axes, loads, strict=True)),
        model.opcode,
        model.at_p,
        model.at_x,
        model.p,
        np.array([np.zeros(model.states) if one.states is None else one.states for one in axes]),
    )
    if not np.isfinite(force).all():
        raise ModelError("the response grew beyond all bounds; try a softer layer")
    return tuple(
        Response(
            isolator_displacement=coordinates[n, 0],
            isolator_velocity=velocity[n],
            force=force[n],
            base_acceleration=accelerations[n, 0],
            floor_acceleration=accelerations[n, 0] + axis.modes.shape @ accelerations[n, 1:],
            floor_displacement=axis.modes.shape @ coordinates[n, 1:],
        )
        for n, axis in enumerate(axes)
    )


def _participation(modes: FixedBaseModes) -> Vector:
    """(modes,) participation factors Φᵀ M r of modes with Φᵀ M Φ = I."""
    return np.asarray(linalg.solve(modes.shape, np.ones(modes.shape.shape[0])))


def _substeps(modes: FixedBaseModes, participation: Vector, base_mass: float, rate: float) -> int:
    # On the layer the base slab is free to move, which makes the highest mode faster than any fixed-base mode.
    squared, load = modes.angular_frequency**2, participation / np.sqrt(base_mass)
    free = np.diag(squared) + np.outer(modes.angular_frequency * load, modes.angular_frequency * load)
    highest = float(np.sqrt(np.linalg.eigvalsh(free)[-1]))
    fastest = highest * max(1.0, 2 * float(modes.damping_ratio.max()))
    return max(SUBSTEPS, ceil(fastest / rate / LARGEST_STEP))


@lru_cache(MOST_CACHED)
def _kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Integration loop for these effects, compiled at its first call."""
    bound_rates = jitted(bound(_rates, layer_force=force_program(laws)))
    return cached(bound(_integrate, rates=bound_rates), force_digest(laws))


layer_force: Any = None
rates: Any = None
"""Placeholders of the functions that are bound before compilation."""


def _rates(y, dy, given, n, base_mass, load, squared, damping, opcode, at_p, at_x, p):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill dy with the rates of y in one direction.

    y holds the displacements of the slab and of the modes, their velocities, and the states of the layer. Returns the
    layer's force.
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
    axes, n, count, h = load.shape[0], 1 + load.shape[1], given.shape[1], dt / substeps
    ahead, weight = (0.0, h / 2, h / 2, h), (h / 6, h / 3, h / 3, h / 6)
    at_x = at_x + 2 * n
    y, dy = np.zeros((axes, 2 * n + states.shape[1])), np.zeros((axes, 2 * n + states.shape[1]))
    y[:, 2 * n :] = states
    coordinates, velocity = np.empty((axes, n, count)), np.empty((axes, count))
    accelerations, force = np.empty((axes, n, count)), np.empty((axes, count))
    for i in range(count):
        slope = (given[:, min(i + 1, count - 1)] - given[:, i]) / dt
        for s in range(substeps):
            end = y.copy()
            for k in range(4):
                t = s * h + ahead[k]
                now, stage = given[:, i] + t * slope, y + ahead[k] * dy
                if axes == 2:  # the layer has the computed motion of both directions
                    now[0, 1], now[0, 2], now[1, 1], now[1, 2] = stage[1, 0], stage[1, n], stage[0, 0], stage[0, n]
                for a in range(axes):
                    f = rates(
                        stage[a], dy[a], now[a], n, base_mass, load[a], squared[a], damping[a], opcode, at_p, at_x, p
                    )
                    if s == 0 and k == 0:
                        force[a, i], velocity[a, i], coordinates[a, :, i] = f, y[a, n], y[a, :n]
                        accelerations[a, 0, i] = dy[a, n] + now[a, 0]
                        accelerations[a, 1:, i] = dy[a, n + 1 : 2 * n]
                end += weight[k] * dy
            y = end
    return coordinates, velocity, accelerations, force
