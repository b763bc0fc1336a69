"""Comparisons of forces with a known, added error."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from core.arrays import Vector
from core.comparison.compared import ForceComparison
from core.fitting.observation import LayerHistory, Observation
from core.model.isolator import Conditions

RATE = 50.0
BAND = (0.1, 24.0)
SECONDS = 80.0
STIFFNESS, DAMPING = 475e6, 6e6
NOISE = 0.01
"""Noise over the force's root mean square."""
PEAKS = (0.01, 0.05, 0.2)
"""m, of the three earthquakes."""
START = datetime(2024, 3, 5, tzinfo=UTC)
Error = Callable[[Observation], Vector]
"""(n,) N, that the model leaves."""


def layer(seed: int, number: int) -> Observation:
    """The layer as a spring and a dashpot, moving about 0.4 Hz."""
    rng = np.random.default_rng([seed, number])
    t = np.arange(0.0, SECONDS, 1 / RATE)
    waves = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6.3)) for f in np.linspace(0.3, 0.5, 6))
    shaken = waves * np.exp(-(((t - SECONDS / 2) / (SECONDS / 5)) ** 2))
    x = PEAKS[number] * shaken / np.abs(shaken).max()
    v = np.gradient(x, 1 / RATE)
    force = STIFFNESS * x + DAMPING * v
    start = START + number * timedelta(days=100)
    return Observation(
        name=f"{start:%Y-%m-%d}",
        direction="x",
        start=start,
        rate=RATE,
        layer=LayerHistory(x, v, force, np.full(t.size, NOISE * np.sqrt(np.mean(force**2))), band=BAND),
        conditions=Conditions.usual(t.size, RATE),
        ground_acceleration=None,
        accelerations=np.zeros((1, t.size)),
        levels=("1F",),
        transducer=True,
    )


def comparisons_with_error(
    error: Error, seed: int = 1, prepare: Callable[[Observation], Observation] = lambda o: o
) -> list[ForceComparison]:
    """The three earthquakes, with a model that is right but for the error.

    Args:
        error: what the model misses.
        seed: of motion and noise.
        prepare: what else an observation is to hold.
    """
    compared = []
    for number in range(len(PEAKS)):
        moved = prepare(layer(seed, number))
        noise = moved.layer.force_std * np.random.default_rng([seed, number, 9]).standard_normal(moved.layer.force.size)
        model = np.asarray(moved.layer.force)
        estimated = replace(moved, layer=replace(moved.layer, force=model + error(moved) + noise))
        compared.append(ForceComparison.of(estimated, np.zeros(0), model, BAND))
    return compared


def no_error(observation: Observation) -> Vector:
    return np.zeros(observation.layer.force.size)


def error_on_one_branch(outwards: bool) -> Error:
    """A force against displacement on the way out, or on the way back, only."""

    def error(observation: Observation) -> Vector:
        x, v = observation.layer.displacement, observation.layer.velocity
        return 0.2 * STIFFNESS * x * ((x * v > 0) == outwards)

    return error


def hardening_error(onset: float) -> Error:
    def error(observation: Observation) -> Vector:
        x = observation.layer.displacement
        return np.asarray(STIFFNESS * np.sign(x) * np.maximum(np.abs(x) - onset, 0.0))

    return error
