"""A model of the isolation layer: effects and their values, and the force it answers a motion with."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from core.arrays import Indices, Matrix, Vector
from core.effects import EFFECTS
from core.errors import ModelError
from core.program import force_program, in_order, jitted


@dataclass(frozen=True, slots=True)
class Isolator:
    """Effects by name, each with the value of every one of its parameters."""

    effects: Mapping[str, Mapping[str, float]]

    def __post_init__(self) -> None:
        for name, values in self.effects.items():
            _check(name, values)
        object.__setattr__(
            self, "effects", MappingProxyType({name: MappingProxyType(dict(v)) for name, v in self.effects.items()})
        )


@dataclass(frozen=True, slots=True, eq=False)
class Packed:
    """A model as the force program reads it; see core.program.source."""

    opcode: Indices
    at_p: Indices
    at_x: Indices
    p: Vector
    states: int


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """What acts on the layer besides its own motion, at every sample."""

    u_cross: Vector
    """(n,) m, displacement in the other horizontal direction."""
    v_cross: Vector
    """(n,) m/s."""
    axial_load: Vector
    """(n,) vertical force / weight, 1 at rest."""
    temperature: Vector
    """(n,) °C."""
    time: Vector
    """(n,) s since the model's reference instant."""

    def __post_init__(self) -> None:
        shapes = {field.name: getattr(self, field.name).shape for field in fields(self)}
        if len(set(shapes.values())) > 1 or self.time.ndim != 1:
            raise ModelError(f"conditions must be alike vectors, got {shapes}")

    @classmethod
    def usual(cls, count: int, rate: float) -> "Conditions":
        """Motion in one direction only, under dead load, at 20 °C, from the reference instant on.

        Args:
            count: of samples.
            rate: Hz.
        """
        zero, one = np.zeros(count), np.ones(count)
        return cls(u_cross=zero, v_cross=zero, axial_load=one, temperature=20 * one, time=np.arange(count) / rate)

    @property
    def rows(self) -> Matrix:
        """(n, 5) in the order of the fields, as the force program reads them."""
        return np.column_stack([getattr(self, field.name) for field in fields(self)])


def packed(isolator: Isolator) -> Packed:
    """The model as arrays, the effects that scale others first."""
    order = in_order(EFFECTS)
    names = sorted(isolator.effects, key=order.index)
    effects = [EFFECTS[name] for name in names]
    sizes = [len(effect.parameters) for effect in effects]
    states = [len(effect.states) for effect in effects]
    return Packed(
        opcode=np.array([order.index(name) for name in names], dtype=np.intp),
        at_p=np.cumsum([0, *sizes])[: len(names)].astype(np.intp),
        at_x=np.cumsum([0, *states])[: len(names)].astype(np.intp),
        p=np.array([isolator.effects[n][q.name] for n, e in zip(names, effects, strict=True) for q in e.parameters]),
        states=sum(states),
    )


def force_history(
    isolator: Isolator, displacement: Vector, velocity: Vector, rate: float, conditions: Conditions | None = None
) -> Vector:
    """Force of the model when the layer moves as was measured, its states at zero before the first sample.

    The states are integrated by the classical Runge-Kutta method, SUBSTEPS per sample, the motion taken as linear
    between samples.

    Args:
        isolator: the model.
        displacement: (n,) m.
        velocity: (n,) m/s.
        rate: Hz.
        conditions: None for the usual ones.

    Returns:
        (n,) N.
    """
    if displacement.shape != velocity.shape or displacement.ndim != 1:
        raise ModelError(f"displacement {displacement.shape} and velocity {velocity.shape} must be alike vectors")
    given = conditions or Conditions.usual(displacement.size, rate)
    motion = np.column_stack([displacement, velocity, given.rows])
    model = packed(isolator)
    force: Vector = _driven()(
        motion, 1 / rate, SUBSTEPS, model.opcode, model.at_p, model.at_x, model.p, np.zeros(model.states)
    )
    return force


SUBSTEPS = 4
"""Per sample, when a model is driven by a measured motion."""


@cache
def _driven() -> Any:  # noqa: ANN401  numba's functions have no type
    """The kernel of force_history, compiled when first asked for."""
    force = force_program()

    @jitted
    def at(m, opcode, at_p, at_x, p, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
        return force(m[0], m[1], m[2], m[3], m[4], m[5], m[6], opcode, at_p, at_x, p, x, dx)

    @jitted
    def accelerations(velocity, dt):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
        found = np.zeros(velocity.size)
        found[1:-1] = (velocity[2:] - velocity[:-2]) / (2 * dt)
        return found

    @jitted
    def driven(motion, dt, substeps, opcode, at_p, at_x, p, x):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
        n, h = motion.shape[0], dt / substeps
        out, acceleration = np.empty(n), accelerations(motion[:, 1], dt)
        k1, k2, k3, k4 = np.zeros(x.size), np.zeros(x.size), np.zeros(x.size), np.zeros(x.size)
        for i in range(n):
            layer, inertance = at(motion[i], opcode, at_p, at_x, p, x, k1)
            out[i] = layer + inertance * acceleration[i]
            if i + 1 == n or x.size == 0:
                continue
            slope = (motion[i + 1] - motion[i]) / dt
            for s in range(substeps):
                t = s * h
                at(motion[i] + slope * t, opcode, at_p, at_x, p, x, k1)
                middle = motion[i] + slope * (t + h / 2)
                at(middle, opcode, at_p, at_x, p, x + h / 2 * k1, k2)
                at(middle, opcode, at_p, at_x, p, x + h / 2 * k2, k3)
                at(motion[i] + slope * (t + h), opcode, at_p, at_x, p, x + h * k3, k4)
                x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return out

    return driven


def _check(name: str, values: Mapping[str, float]) -> None:
    if name not in EFFECTS:
        raise ModelError(f"there is no effect {name!r}; there are {', '.join(sorted(EFFECTS))}")
    parameters = {parameter.name: parameter for parameter in EFFECTS[name].parameters}
    if set(values) != set(parameters):
        raise ModelError(f"{name} takes values for {sorted(parameters)}, got {sorted(values)}")
    for key, value in values.items():
        low, high = parameters[key].bounds
        if not low <= value <= high:
            raise ModelError(
                f"{name}: {key} must lie within {low:g} ... {high:g} {parameters[key].unit}, got {value:g}"
            )
