"""How does a model of the isolation layer compare with what was measured, driven by the measured motion?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.conditioning import band_passed
from core.driven import force_history
from core.isolator import Isolator
from core.misfit import Misfit, misfit, together
from core.observation import LayerHistory, Observation

Band = tuple[float, float]
"""Hz, pass band of the estimated force: the model's is held against it within the same."""
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, slots=True, eq=False)
class ForceComparison:
    """One earthquake in one direction: the model's force for the measured motion, against the estimated one."""

    observation: Observation
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
    """In order of time.

    Args:
        isolator: the model.
        observations: what was measured.
        band: Hz.
    """
    return tuple(_compared(isolator, one, band) for one in sorted(observations, key=lambda one: one.start))


def _compared(isolator: Isolator, observation: Observation, band: Band) -> ForceComparison:
    layer, rate = observation.layer, observation.rate
    force = force_history(isolator, layer.displacement, layer.velocity, rate, observation.conditions)
    model = band_passed(force, rate, band)
    std = np.hypot(layer.force_std, _std_from_motion(layer, model))
    return ForceComparison(observation, model, std, misfit(layer.force, model, std))


def _std_from_motion(layer: LayerHistory, model: Vector) -> Vector:
    """(n,) N, what the displacement's uncertainty makes of the model's force, by the stiffness that it moves with."""
    if layer.displacement_std is None:
        return np.zeros(model.size)
    stiffness = np.linalg.norm(np.diff(model)) / max(float(np.linalg.norm(np.diff(layer.displacement))), TINY)
    return np.asarray(stiffness * layer.displacement_std)


def force_misfit(compared: Sequence[ForceComparison]) -> Misfit:
    """Over all earthquakes."""
    return together([one.misfit for one in compared])
