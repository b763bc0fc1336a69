"""Covariates of every sample of a force: amplitude, velocity, travel, time, temperature and others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Vector
from core.fitting.observation import Observation

PHASES = ("on loading", "on unloading", "around the reversals")
"""Away from the middle, back to it, and between."""
REVERSAL = 0.9
"""Share of a half cycle's largest displacement beyond which a sample is near the reversal. A choice."""
COUNTED = 0.1
"""Smallest half cycle that counts, as a share of the record's largest displacement. A choice."""
TRACE = 1e-9
"""Smallest range of a covariate that counts as a change, as a share of its larger end. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Covariate:
    """A quantity on which a model's error may depend, at every sample of all earthquakes."""

    name: str
    values: Vector
    """(n,) SI units; of a covariate with classes, the index of the sample's."""
    classes: tuple[str, ...] = ()
    """Empty of one that is a number."""


def covariates(observations: Sequence[Observation]) -> tuple[Covariate, ...]:
    """Covariates that vary between samples, in order of importance.

    Args:
        observations: in order of time; their samples follow one another.
    """
    past = _past(observations)
    rows = [_of_one(observation, before) for observation, before in zip(observations, past, strict=True)]
    numbers = [Covariate(name, np.concatenate([row[name] for row in rows])) for name in rows[0]]
    phase = Covariate("phase", np.concatenate([_phase(one.layer.displacement) for one in observations]), PHASES)
    counts = [one.layer.displacement.size for one in observations]
    names = tuple(f"{one.name}, direction {one.direction}" for one in observations)
    earthquake = Covariate("earthquake", np.repeat(np.arange(len(names), dtype=float), counts), names)
    return tuple(one for one in (*numbers, phase, earthquake) if _changes(one.values))


def _of_one(observation: Observation, past: float) -> dict[str, Vector]:
    """Numbers of one earthquake, by name.

    Args:
        observation: the earthquake.
        past: m, largest displacement in all earthquakes before it.
    """
    x, v, step = observation.layer.displacement, observation.layer.velocity, 1 / observation.rate
    given = observation.conditions
    return {
        "amplitude": half_cycle_amplitude(x),
        "velocity": np.abs(v),
        "largest past displacement": np.maximum(np.maximum.accumulate(np.abs(x)), past),
        "travel": np.cumsum(np.abs(v)) * step,
        "cycle": _cycle(x),
        "time": np.arange(x.size) * step,
        "other direction": np.abs(given.u_cross),
        "vertical load": given.axial_load,
        "temperature": given.temperature,
    }


def half_cycle_amplitude(displacement: Vector) -> Vector:
    """(n,) m, at each sample the largest displacement between the zero crossings on its two sides."""
    starts = _half_cycles(displacement)
    largest = np.maximum.reduceat(np.abs(displacement), starts)
    return np.repeat(largest, np.diff([*starts, displacement.size]))


def _half_cycles(displacement: Vector) -> Indices:
    """First sample of each stretch on one side of zero."""
    return np.concatenate([[0], 1 + np.flatnonzero(np.diff(displacement >= 0))]).astype(np.intp)


def _phase(displacement: Vector) -> Vector:
    """(n,) index into PHASES."""
    turning = np.abs(displacement) > REVERSAL * half_cycle_amplitude(displacement)
    outwards = displacement * np.gradient(displacement) > 0
    return np.where(turning, 2.0, np.where(outwards, 0.0, 1.0))


def _cycle(displacement: Vector) -> Vector:
    """(n,) number of cycles before each sample, in halves."""
    starts = _half_cycles(displacement)
    largest = np.maximum.reduceat(np.abs(displacement), starts)
    counted = np.cumsum(largest > COUNTED * largest.max()) / 2
    return np.repeat(counted, np.diff([*starts, displacement.size]))


def _past(observations: Sequence[Observation]) -> list[float]:
    """m, largest displacement in the same direction before each."""
    largest: dict[str, float] = {}
    before = []
    for one in observations:
        before.append(largest.get(one.direction, 0.0))
        largest[one.direction] = max(before[-1], float(np.abs(one.layer.displacement).max()))
    return before


def _changes(values: Vector) -> bool:
    low, high = float(values.min()), float(values.max())
    return high - low > TRACE * max(abs(low), abs(high))
