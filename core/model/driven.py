"""What force does a model answer a measured motion with, and how does it change with the model's parameters?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.effect import RESULTS
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.driven_kernels import column_kernel, force_kernel, tangent_kernel
from core.model.isolator import Conditions, Isolator, Key, Packed, packed, parameter_names
from core.model.path import Path, path


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """A model's answer to a motion. Where the steps were too long for a law, numbers in it are not finite."""

    force: Vector
    """(n,) N."""
    by_parameter: Matrix
    """(wanted, n) N per unit of each wanted parameter."""
    states: Vector
    """(m,) at the last sample, in the order of core.model.isolator.state_names."""
    states_by_parameter: Matrix
    """(wanted, m)."""


def force_history(
    isolator: Isolator, displacement: Vector, velocity: Vector, rate: float, conditions: Conditions | None = None
) -> Vector:
    """Force of the model when the layer moves as was measured, its states at zero before the first sample; see driven.

    Returns:
        (n,) N.
    """
    return driven(isolator, displacement, velocity, rate, conditions=conditions).force


def driven(
    isolator: Isolator,
    displacement: Vector,
    velocity: Vector,
    rate: float,
    *,
    conditions: Conditions | None = None,
    wanted: Sequence[Key] = (),
    states: Vector | None = None,
    states_by_parameter: Matrix | None = None,
    substeps: int | None = None,
) -> Driven:
    """Force of the model when the layer moves as was measured, and its exact derivatives by parameters.

    The states are integrated by the classical Runge-Kutta method; motion and conditions are cubic between samples, with
    the slopes of Catmull and Rom (1974). Linear motion at 100 Hz would put a Bouc-Wen layer's force wrong by up to 4e-4
    of its rms however fine the steps, cubic motion by 8e-5 with one step per sample and by 2e-5 with two. Derivatives
    are those of what is computed, step by step; see core.laws.tangent.

    Args:
        isolator: the model.
        displacement: (n,) m, n at least 2.
        velocity: (n,) m/s.
        rate: Hz.
        conditions: None for the usual ones.
        wanted: parameters to differentiate by.
        states: (m,) at the first sample; None for zero. See core.model.isolator.carried.
        states_by_parameter: (wanted, m) at the first sample; None for zero.
        substeps: per sample; None for as many as the laws ask for, see core.model.driven_kernels.

    Raises:
        ModelError: what is given differs in length, or a wanted parameter is none of the model's.
    """
    way = path(displacement, velocity, rate, conditions, substeps)
    return along(way, isolator, wanted=wanted, states=states, states_by_parameter=states_by_parameter)


def along(
    way: Path,
    isolator: Isolator,
    *,
    wanted: Sequence[Key] = (),
    states: Vector | None = None,
    states_by_parameter: Matrix | None = None,
) -> Driven:
    """The same along a path that many models are driven along.

    Raises:
        ModelError: what is given differs in length, or a wanted parameter is none of the model's.
    """
    model = packed(isolator)
    start = np.zeros(model.states) if states is None else states
    changes = np.zeros((len(wanted), model.states)) if states_by_parameter is None else states_by_parameter
    if start.shape != (model.states,) or changes.shape != (len(wanted), model.states):
        raise ModelError(
            f"the model has {model.states} states and {len(wanted)} parameters are wanted; the states at the "
            f"start are {start.shape}, their derivatives {changes.shape}"
        )
    return _answer(way, model, [_wanted(model, isolator, key) for key in wanted], start, changes)


def _answer(way: Path, model: Packed, wanted: list["_Wanted"], start: Vector, changes: Matrix) -> Driven:
    force, _, states = _integrated(way, model, np.zeros(model.p.size), start, 0)
    by_parameter, by_end = np.empty((len(wanted), force.size)), np.zeros((len(wanted), model.states))
    at_once = [n for n, one in enumerate(wanted) if one.stateless and not changes[n].any()]
    if at_once:
        directions = np.array([wanted[n].direction for n in at_once])
        arrays = way.samples, way.acceleration, model.opcode, model.at_p, model.at_x, model.p
        by_parameter[at_once] = column_kernel(model.laws)(*arrays, directions, states)
    for n in sorted({*range(len(wanted))} - {*at_once}):
        both = np.concatenate([start, changes[n]])
        _, by_parameter[n], followed = _integrated(way, model, wanted[n].direction, both, model.states)
        by_end[n] = followed[-1, model.states :]
    return Driven(force=force, by_parameter=by_parameter, states=states[-1], states_by_parameter=by_end)


def _integrated(way: Path, model: Packed, direction: Vector, start: Vector, behind: int) -> tuple[Vector, ...]:
    kernel = (tangent_kernel if behind else force_kernel)(model.laws)
    found: tuple[Vector, ...] = kernel(
        way.samples,
        way.acceleration,
        way.weights,
        way.interval,
        way.least,
        model.opcode,
        model.at_p,
        model.at_x,
        model.p,
        direction,
        behind,
        start,
    )
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Wanted:
    direction: Vector
    """Of the packed parameters: 1 at this one."""
    stateless: bool
    """Whether no state depends on it."""


def _wanted(model: Packed, isolator: Isolator, key: Key) -> _Wanted:
    keys = parameter_names(isolator)
    if key not in keys:
        raise ModelError(f"the model has no parameter {key}; it has {', '.join(map(str, keys))}")
    effect = EFFECTS[key[0]]
    direction = np.zeros(len(keys))
    direction[keys.index(key)] = 1.0
    own = key[1] in effect.linear or not effect.states
    return _Wanted(direction, stateless=model.states == 0 or (effect.acts_on in RESULTS and own))
