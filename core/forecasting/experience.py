"""Experience with a model's forecasts, from records: covariance of its values, its own error, and the range seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from math import log, sqrt
from typing import Literal

import numpy as np

from core.arrays import Matrix, Vector
from core.building import FixedBaseModes
from core.comparison.compared import ForceComparison
from core.comparison.prediction import Predicted, Prediction
from core.description import BuildingDescription
from core.effect import LogNormal
from core.fitting.data import FitData
from core.fitting.fit import Fit, finish_search, inflation, reweighted_data, tangents
from core.fitting.observation import Observation
from core.fitting.search import Outcome, start_search
from core.frozen import FrozenDict
from core.model.force_response import force_response
from core.model.isolator import Isolator, Key, carried, parameter
from core.record import Direction

Kind = Literal["displacement", "acceleration"]
LONGEST_STEP = 0.7
"""Longest step of the logarithm of a value, about a factor of two; what is known less is extrapolated from such a step.
A choice."""
ASLEEP = 1e-3
"""Share of the force that an effect's value changes, over all records, below which no record has made it act. A
choice."""


@dataclass(frozen=True, slots=True)
class Miss:
    """Error of the response that a model predicts from one record's ground motion."""

    kind: Kind
    level: str
    """Level of an acceleration; empty for the layer's displacement."""
    amplitude: float
    """m, largest displacement of the layer in the record."""
    peak: float
    """Logarithm of the measured peak over the predicted one."""
    history: float
    """Error of the history over the measured one, both root mean squares."""


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Uncertainty of a model's values as independent steps along the principal axes of their covariance."""

    keys: tuple[Key, ...]
    """Values that the records determine."""
    steps: Matrix
    """(steps, keys) in logarithms of the values where `in_logarithm`, else in their SI units."""
    lengths: Vector
    """(steps,) standard deviations per step: 1, or more where one would change a value too much."""
    in_logarithm: tuple[bool, ...]
    """By key."""

    def moved(self, model: Isolator, step: int, sign: float) -> Isolator:
        """The model a step away, its values kept within their ranges."""
        values = {name: dict(own) for name, own in model.effects.items()}
        for (effect, name), change, by_ratio in zip(self.keys, self.steps[step], self.in_logarithm, strict=True):
            value, bounds = values[effect][name], parameter((effect, name)).bounds
            there = value * np.exp(sign * change) if by_ratio else value + sign * change
            values[effect][name] = float(np.clip(there, *bounds))
        return Isolator(values)


@dataclass(frozen=True, slots=True, eq=False)
class Experience:
    """All that a forecast takes from the records of a building."""

    spread: Spread
    misses: tuple[Miss, ...]
    displacement: float
    """m, largest of the layer in the records that the model was fitted to."""
    velocity: float
    """m/s, the same."""
    asleep: tuple[Key, ...]
    """Values that no record determines, because nothing made their effect act."""
    temperatures: tuple[float, float]
    """°C, lowest and highest of the records."""
    states: Mapping[Direction, Vector]
    """(m,) of the layer after the last record."""
    superstructures: Mapping[Direction, FixedBaseModes]
    """All modes, by direction."""
    period: float
    """s, of the building as a rigid body on the isolators, by the secant stiffness in the strongest record."""
    last: datetime
    """End of the last record."""


def experience(
    model: Isolator,
    forces: Sequence[ForceComparison],
    predictions: Sequence[Prediction],
    fitted: Sequence[Observation],
    superstructures: Mapping[Direction, FixedBaseModes],
    description: BuildingDescription,
) -> Experience:
    """Experience with a model's forecasts, from the records of a building.

    Args:
        model: with fitted values.
        forces: the model beside every record.
        predictions: from the ground motion alone, of every record in which that was measured.
        fitted: observations that the values were fitted to.
        superstructures: all modes, by direction.
        description: of the building.

    Raises:
        RecordError: there are no observations.
        ModelError: the model's force grew beyond all bounds.
    """
    spread, asleep = _values(model, fitted)
    layers = [one.layer for one in fitted]
    temperatures = [one.conditions.temperature for one in fitted]
    observations = [one.observation for one in forces]
    return Experience(
        spread=spread,
        misses=tuple(miss for one in predictions for miss in _misses(one)),
        displacement=max(float(np.abs(layer.displacement).max()) for layer in layers),
        velocity=max(float(np.abs(layer.velocity).max()) for layer in layers),
        asleep=asleep,
        temperatures=(min(float(t.min()) for t in temperatures), max(float(t.max()) for t in temperatures)),
        states=FrozenDict(_states(model, forces)),
        superstructures=FrozenDict(superstructures),
        period=_period(observations, description),
        last=max(one.start + timedelta(seconds=(one.layer.force.size - 1) / one.rate) for one in observations),
    )


def _values(model: Isolator, fitted: Sequence[Observation]) -> tuple[Spread, tuple[Key, ...]]:
    """Uncertainty of the values as the records leave it, and the values of effects that did not act."""
    by_noise = FitData.by_noise(sorted(fitted, key=lambda one: one.start))
    first = _at_own_values(by_noise, model)
    data = reweighted_data(by_noise, first)
    found = _at_own_values(data, first.model)
    spread = _spread(model, found, inflation(data, found))
    asleep = _asleep(model, data, found)
    data.memory.clear()
    return spread, asleep


def _at_own_values(data: FitData, model: Isolator) -> Fit:
    """The fit that begins, and ends, at the model's values."""
    search = start_search(data, model)
    outcome = Outcome.DIVERGED if search.outcome is Outcome.DIVERGED else Outcome.STOPPED
    return finish_search(data, search, outcome)


def _spread(model: Isolator, fit: Fit, factor: float) -> Spread:
    """The covariance of the determined values by its principal axes, values of one sign by their logarithm."""
    if fit.outcome is Outcome.DIVERGED:
        return Spread((), np.zeros((0, 0)), np.zeros(0), ())
    rows = [row for row, key in enumerate(fit.free) if key not in fit.undetermined and fit.covariance[row, row] > 0]
    keys = tuple(fit.free[row] for row in rows)
    values = np.array([model.effects[effect][name] for effect, name in keys])
    by_ratio = [
        isinstance(parameter(key).prior, LogNormal) and value > 0 for key, value in zip(keys, values, strict=True)
    ]
    scale = np.where(by_ratio, values, 1.0)
    covariance = factor * fit.covariance[np.ix_(rows, rows)] / np.outer(scale, scale)
    std = np.sqrt(np.diag(covariance))
    own, axes = np.linalg.eigh(covariance / np.outer(std, std)) if rows else (np.zeros(0), np.zeros((0, 0)))
    steps = (axes * np.sqrt(np.maximum(own, 0.0))).T * std
    longest = np.max(np.abs(np.where(by_ratio, steps, 0.0)), axis=1, initial=0.0)
    lengths = np.maximum(1.0, longest / LONGEST_STEP)
    return Spread(keys, steps / lengths[:, None], lengths, tuple(by_ratio))


def _asleep(model: Isolator, data: FitData, fit: Fit) -> tuple[Key, ...]:
    if fit.outcome is Outcome.DIVERGED:
        return ()
    turned, force = tangents(data, fit), float(np.linalg.norm(data.target))
    sizes = {key: float(np.linalg.norm(row)) * typical(model, key) for key, row in zip(fit.free, turned, strict=True)}
    return tuple(key for key in fit.undetermined if sizes[key] < ASLEEP * force)


def typical(model: Isolator, key: Key) -> float:
    """Size of a value, or its prior's median where it is zero."""
    return abs(model.effects[key[0]][key[1]]) or abs(parameter(key).prior.median)


def _misses(prediction: Prediction) -> list[Miss]:
    amplitude = float(np.abs(prediction.observation.layer.displacement).max())

    def miss(kind: Kind, level: str, one: Predicted) -> Miss | None:
        predicted, measured = (float(np.abs(series).max()) for series in (one.model, one.measured))
        if not (predicted > 0 and measured > 0):
            return None
        return Miss(kind, level, amplitude, log(measured / predicted), one.misfit.nrmse)

    every = [miss("displacement", "", prediction.displacement)]
    every += [miss("acceleration", level, one) for level, one in prediction.accelerations.items()]
    return [one for one in every if one is not None]


def _states(model: Isolator, forces: Sequence[ForceComparison]) -> dict[Direction, Vector]:
    """States of the layer after the last record in each direction."""
    states: dict[Direction, Vector] = {}
    for one in forces:
        seen = one.observation
        answer = force_response(
            model,
            seen.layer.displacement,
            seen.layer.velocity,
            seen.rate,
            conditions=seen.conditions,
            states=one.states,
        )
        states[seen.direction] = carried(model, answer.states)
    return states


def _period(observations: Sequence[Observation], description: BuildingDescription) -> float:
    layer = max((one.layer for one in observations), key=lambda one: float(np.abs(one.displacement).max()))
    stiffness = float(np.abs(layer.force).max()) / float(np.abs(layer.displacement).max())
    return 2 * np.pi * sqrt((description.base_mass + float(description.floor_mass.sum())) / stiffness)
