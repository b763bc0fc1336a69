"""How does a model of the isolation layer compare with what was measured, driven by the measured motion?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.comparison.misfit import Misfit, misfit, pooled
from core.errors import ModelError
from core.fitting.observation import LayerHistory, Observation
from core.model.force_response import force_response
from core.model.isolator import Isolator, carried, state_names
from core.record import Direction
from core.signals.conditioning import band_passed

Band = tuple[float, float]
"""Hz, pass band of the estimated force: the model's is held against it within the same."""
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, slots=True, eq=False)
class ForceComparison:
    """One earthquake in one direction: the model's force for the measured motion, against the estimated one."""

    observation: Observation
    states: Vector
    """(m,) of the model before the earthquake, in the order of core.model.isolator.state_names."""
    model: Vector
    """(n,) N, within the pass band."""
    std: Vector
    """(n,) N, standard deviation of the residual of a right model: of the estimate, and of the motion that drives."""
    misfit: Misfit
    """N."""

    @property
    def residual(self) -> Vector:
        """(n,) N, estimated − model."""
        return np.asarray(self.observation.layer.force - self.model)


def compare_forces(isolator: Isolator, observations: Sequence[Observation], band: Band) -> tuple[ForceComparison, ...]:
    """In order of time; what the layer keeps passes from each earthquake to the next in the same direction.

    Before the first it is taken to be new: whatever the effects carry is at zero.

    Args:
        isolator: the model.
        observations: what was measured.
        band: Hz.

    Raises:
        ModelError: the model's force grew beyond all bounds.
    """
    kept: dict[Direction, Vector] = {}
    compared = []
    for one in sorted(observations, key=lambda one: one.start):
        start = kept.get(one.direction, np.zeros(len(state_names(isolator))))
        layer = one.layer
        answer = force_response(
            isolator, layer.displacement, layer.velocity, one.rate, conditions=one.conditions, states=start
        )
        kept[one.direction] = carried(isolator, answer.states)
        compared.append(_compared(one, start, answer.force, band))
    return tuple(compared)


def _compared(observation: Observation, states: Vector, force: Vector, band: Band) -> ForceComparison:
    layer = observation.layer
    if not np.isfinite(force).all():
        raise ModelError(f"{observation.name}: the model's force grew beyond all bounds; a softer law would do")
    model = band_passed(force, observation.rate, band)
    std = np.hypot(layer.force_std, _std_from_motion(layer, model))
    return ForceComparison(observation, states, model, std, misfit(layer.force, model, std))


def _std_from_motion(layer: LayerHistory, model: Vector) -> Vector:
    """(n,) N, what the displacement's uncertainty makes of the model's force, by the stiffness that it moves with."""
    if layer.displacement_std is None:
        return np.zeros(model.size)
    stiffness = np.linalg.norm(np.diff(model)) / max(float(np.linalg.norm(np.diff(layer.displacement))), TINY)
    return np.asarray(stiffness * layer.displacement_std)


def force_misfit(compared: Sequence[ForceComparison]) -> Misfit:
    """Over all earthquakes."""
    return pooled([one.misfit for one in compared])
