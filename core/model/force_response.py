"""Force of an isolation layer model under a prescribed motion, with its derivatives by the model's parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil

import numpy as np

from core.arrays import Indices, Matrix, Vector
from core.effect import RESULTS
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.force_kernels import force_kernel, tangent_kernel
from core.model.isolator import Conditions, Isolator, Key, PackedModel, packed, parameter_names
from core.model.program import DIRECTIONS

LONGEST_STEP = 1e-2
"""s, longest step of the integration. A choice."""
MOST_HALVINGS = 2
"""Times that a step may be halved where a law needs shorter steps. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """Prescribed motion and conditions, interpolated by the cubic splines of Catmull and Rom (1974)."""

    samples: Matrix
    """(n + 3, 8) u, v and the conditions' rows, from one before the first sample to two after the last."""
    acceleration: Vector
    """(n,) m/s², of the layer."""
    weights: Matrix
    """(2 * steps + 1, 4) of four neighbouring samples, at the ends and the middle of each of the shortest steps."""
    interval: float
    """s, between samples."""
    fewest_steps: int
    """Smallest number of steps between samples."""


@dataclass(frozen=True, slots=True, eq=False)
class StateHistory:
    """States of a model at every sample, and the steps by which they were integrated."""

    states: Matrix
    """(n, m)."""
    steps: Indices
    """(n,) between each sample and the next."""

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return self.states.nbytes + self.steps.nbytes

    def __getitem__(self, span: slice) -> "StateHistory":
        return StateHistory(self.states[span], self.steps[span])


@dataclass(frozen=True, slots=True, eq=False)
class ForceResponse:
    """Response of a model to a prescribed motion. Values are not finite if the steps were too long for a law."""

    force: Vector
    """(n,) N."""
    by_parameter: Matrix
    """(wanted, n) derivative of the force, in N per unit of each wanted parameter."""
    states: Vector
    """(m,) at the last sample, in the order of core.model.isolator.state_names."""
    states_by_parameter: Matrix
    """(wanted, m) derivatives of the states at the last sample."""


@dataclass(frozen=True, slots=True, eq=False)
class ParameterDirection:
    """A wanted parameter as a direction in the space of all parameters."""

    unit: Vector
    """Change of the packed parameters: 1 at this one."""
    stateless: bool
    """True if no state depends on it."""


def force_history(
    isolator: Isolator, displacement: Vector, velocity: Vector, rate: float, conditions: Conditions | None = None
) -> Vector:
    """Force of the model under a measured motion, with zero states at the first sample; see force_response.

    Returns:
        (n,) N.
    """
    return force_response(isolator, displacement, velocity, rate, conditions=conditions).force


def force_response(
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
) -> ForceResponse:
    """Force of the model under a measured motion, and its exact derivatives by parameters.

    The states are integrated by the classical Runge-Kutta method; motion and conditions are cubic between samples, with
    the slopes of Catmull and Rom (1974). With linear interpolation at 100 Hz, a Bouc-Wen layer's force has an error of
    up to 4e-4 of its rms however short the steps; with cubic interpolation, 8e-5 with one step per sample and 2e-5 with
    two. The derivatives are those of the computed values, step by step; see core.code_generation.autodiff.

    Args:
        isolator: the model.
        displacement: (n,) m, n at least 2.
        velocity: (n,) m/s.
        rate: Hz.
        conditions: None for Conditions.usual.
        wanted: parameters of the derivatives.
        states: (m,) at the first sample; None for zero. See core.model.isolator.carried.
        states_by_parameter: (wanted, m) at the first sample; None for zero.
        substeps: per sample; None for as many as the laws need, see core.model.force_kernels.

    Raises:
        ModelError: arrays differ in length, or the model lacks a wanted parameter.
    """
    excited = excitation(displacement, velocity, rate, conditions, substeps)
    return response_to(excited, isolator, wanted=wanted, states=states, states_by_parameter=states_by_parameter)


def response_to(
    excited: Excitation,
    isolator: Isolator,
    *,
    wanted: Sequence[Key] = (),
    states: Vector | None = None,
    states_by_parameter: Matrix | None = None,
) -> ForceResponse:
    """Force response to an excitation that many models share; see force_response.

    Raises:
        ModelError: arrays differ in length, or the model lacks a wanted parameter.
    """
    model = packed(isolator)
    start = np.zeros(model.states) if states is None else states
    changes = np.zeros((len(wanted), model.states)) if states_by_parameter is None else states_by_parameter
    if start.shape != (model.states,) or changes.shape != (len(wanted), model.states):
        raise ModelError(
            f"the model has {model.states} states and {len(wanted)} parameters are wanted; the states at the "
            f"start are {start.shape}, their derivatives {changes.shape}"
        )
    force, followed = _integrated(excited, model, start)
    by_parameter, by_end = force_derivatives(
        excited, model, parameter_directions(model, isolator, wanted), followed, changes
    )
    return ForceResponse(force, by_parameter, followed.states[-1], by_end)


def state_history(excited: Excitation, model: PackedModel, start: Vector) -> StateHistory:
    """States of a model at every sample of an excitation.

    Args:
        excited: motion and conditions, n samples.
        model: with m states.
        start: (m,) at the first sample.
    """
    if model.states == 0:
        count = excited.acceleration.size
        return StateHistory(np.empty((count, 0)), np.ones(count, dtype=np.intp))
    return _integrated(excited, model, start)[1]


def force_derivatives(
    excited: Excitation,
    model: PackedModel,
    wanted: Sequence[ParameterDirection],
    followed: StateHistory,
    changes: Matrix,
) -> tuple[Matrix, Matrix]:
    """Derivatives of the force, and of the last sample's states.

    Those that involve no state are computed sample by sample, the others in an integration, DIRECTIONS at a time.

    Args:
        excited: motion and conditions, n samples.
        model: with m states.
        wanted: parameters.
        followed: states of the model.
        changes: (wanted, m) derivatives of the states at the first sample.

    Returns:
        (wanted, n) N, and (wanted, m), per unit of each parameter.
    """
    by_parameter, by_end = np.empty((len(wanted), followed.steps.size)), np.zeros((len(wanted), model.states))
    kernel, motion, arrays = tangent_kernel(model.laws), _motion(excited), _arrays(model)
    moving = [not one.stateless or bool(changes[n].any()) for n, one in enumerate(wanted)]
    for is_moving in (False, True):
        those = [n for n, one in enumerate(moving) if one == is_moving]
        for first in range(0, len(those), DIRECTIONS):
            each = those[first : first + DIRECTIONS]
            units, at_start = np.zeros((DIRECTIONS, model.p.size)), np.zeros((DIRECTIONS, model.states))
            units[: len(each)], at_start[: len(each)] = [wanted[n].unit for n in each], changes[each]
            made, room = np.empty((DIRECTIONS, followed.steps.size)), np.zeros((4, (DIRECTIONS + 1) * model.states))
            kernel(motion, arrays, units, is_moving, followed.states, followed.steps, made, at_start.ravel(), room)
            by_parameter[each], by_end[each] = made[: len(each)], at_start[: len(each)]
    return by_parameter, by_end


def excitation(
    displacement: Vector,
    velocity: Vector,
    rate: float,
    conditions: Conditions | None = None,
    substeps: int | None = None,
) -> Excitation:
    """Excitation by a measured motion.

    Args:
        displacement: (n,) m, n at least 2.
        velocity: (n,) m/s.
        rate: Hz.
        conditions: None for Conditions.usual.
        substeps: exact number per sample; None for as many as LONGEST_STEP needs, or more after MOST_HALVINGS.

    Raises:
        ModelError: arrays differ in length.
    """
    given = conditions or Conditions.usual(displacement.size, rate)
    if not displacement.shape == velocity.shape == given.time.shape or displacement.size < 2:
        raise ModelError(
            f"displacement {displacement.shape}, velocity {velocity.shape} and conditions {given.time.shape} must be "
            "alike vectors of two samples or more"
        )
    fewest = substeps or ceil(1 / (rate * LONGEST_STEP) - 1e-9)
    weights = _weights(substeps or fewest * 2**MOST_HALVINGS)
    samples, acceleration = _extrapolated(displacement, velocity, given), _acceleration(velocity, rate)
    return Excitation(samples, acceleration, weights, 1 / rate, fewest)


def _extrapolated(displacement: Vector, velocity: Vector, given: Conditions) -> Matrix:
    """(n + 3, 8) motion and conditions, extrapolated linearly by one sample at the start and by two at the end."""
    samples = np.empty((displacement.size + 3, 8))
    samples[1:-2, 0], samples[1:-2, 1], samples[1:-2, 2:] = displacement, velocity, given.rows
    samples[0] = 2 * samples[1] - samples[2]
    samples[-2:] = 2 * samples[-3] - samples[-4]
    return samples


def _acceleration(velocity: Vector, rate: float) -> Vector:
    """(n,) m/s², by central differences of fourth order, and of second order at the ends."""
    if velocity.size < 5:
        return np.gradient(velocity, 1 / rate)
    acceleration = np.gradient(velocity, 1 / rate, edge_order=2)
    wide = (velocity[4:] - velocity[:-4]) / (4 / rate)
    acceleration[2:-2] = (4 * acceleration[2:-2] - wide) / 3
    return acceleration


@cache
def _weights(substeps: int) -> Matrix:
    """(2 * substeps + 1, 4) Catmull-Rom weights between two samples."""
    t = np.linspace(0, 1, 2 * substeps + 1)
    return 0.5 * np.column_stack(
        [t * (t * (2 - t) - 1), t * t * (3 * t - 5) + 2, t * (t * (4 - 3 * t) + 1), t * t * (t - 1)]
    )


def parameter_directions(
    model: PackedModel, isolator: Isolator, wanted: Sequence[Key]
) -> tuple[ParameterDirection, ...]:
    """Directions of these parameters.

    Raises:
        ModelError: the model lacks one of them.
    """
    keys = parameter_names(isolator)
    return tuple(_direction(model, keys, key) for key in wanted)


def _direction(model: PackedModel, keys: Sequence[Key], key: Key) -> ParameterDirection:
    if key not in keys:
        raise ModelError(f"the model has no parameter {key}; it has {', '.join(map(str, keys))}")
    effect = EFFECTS[key[0]]
    unit = np.zeros(len(keys))
    unit[keys.index(key)] = 1.0
    own = key[1] in effect.linear or not effect.states
    return ParameterDirection(unit, stateless=model.states == 0 or (effect.acts_on in RESULTS and own))


def _integrated(excited: Excitation, model: PackedModel, start: Vector) -> tuple[Vector, StateHistory]:
    """(n,) force, and the states, from (m,) states at the first sample."""
    count = excited.acceleration.size
    force, states, steps = np.empty(count), np.empty((count, start.size)), np.empty(count, dtype=np.intp)
    room = np.zeros((7, start.size))
    force_kernel(model.laws)(_motion(excited), _arrays(model), start, force, states, steps, room)
    return force, StateHistory(states, steps)


def _motion(excited: Excitation) -> tuple[Matrix, Vector, Matrix, float, int]:
    """Arguments of the kernels."""
    return excited.samples, excited.acceleration, excited.weights, excited.interval, excited.fewest_steps


def _arrays(model: PackedModel) -> tuple[Indices, Indices, Indices, Vector]:
    """Arguments of the kernels."""
    return model.opcode, model.at_p, model.at_x, model.p
