"""A model's force for the measured motion, against the estimated force."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.comparison.misfit import Misfit, misfit_at_ratio, pooled
from core.errors import ModelError
from core.fitting.noise import ForceNoise, force_noise
from core.fitting.observation import Observation, excitation_by
from core.model.force_response import response_to
from core.model.isolator import Isolator, carried, state_names
from core.record import Direction
from core.signals.conditioning import band_passed

Band = tuple[float, float]
"""Hz, pass band of the estimated force, in which the model's force is compared with it."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceComparison:
    """One earthquake in one direction: the model's force for the measured motion, against the estimated one."""

    observation: Observation
    states: Vector
    """(m,) of the model before the earthquake, in the order of core.model.isolator.state_names."""
    model: Vector
    """(n,) N, within the pass band."""
    noise: ForceNoise
    """Noise in the residual of a correct model."""
    resolved: Vector
    """(n,) N, the part of the residual whose noise is known."""
    misfit: Misfit
    """N."""

    @classmethod
    def of(cls, observation: Observation, states: Vector, force: Vector, band: Band) -> "ForceComparison":
        """A comparison with a model's force.

        Args:
            observation: the earthquake.
            states: (m,) of the model before it.
            force: (n,) N, the model's, unfiltered.
            band: Hz, pass band of the estimated force.
        """
        measured, noise = observation.layer.force, force_noise(observation)
        model, resolved = band_passed(force, observation.rate, band), noise.residual(measured, force)
        ratio = float(np.sqrt(np.mean(resolved**2))) / noise.rms
        return cls(observation, states, model, noise, resolved, misfit_at_ratio(measured, model, ratio, noise.rms))

    @property
    def residual(self) -> Vector:
        """(n,) N, estimated − model."""
        return np.asarray(self.observation.layer.force - self.model)


def compare_forces(isolator: Isolator, observations: Sequence[Observation], band: Band) -> tuple[ForceComparison, ...]:
    """In order of time; what the layer keeps passes from each earthquake to the next in the same direction.

    Before the first the layer is new: all carried states are zero.

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
        answer = response_to(excitation_by(one), isolator, states=start)
        kept[one.direction] = carried(isolator, answer.states)
        if not np.isfinite(answer.force).all():
            raise ModelError(f"{one.name}: the model's force grew beyond all bounds; use a softer law")
        compared.append(ForceComparison.of(one, start, answer.force, band))
    return tuple(compared)


def force_misfit(compared: Sequence[ForceComparison]) -> Misfit:
    """Misfit over all earthquakes."""
    return pooled([one.misfit for one in compared])
