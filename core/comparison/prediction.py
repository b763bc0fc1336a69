"""Response of building and layer predicted from the ground motion alone, beside the measurements."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from core.arrays import Vector
from core.building import FixedBaseModes
from core.comparison.compared import Band, ForceComparison
from core.comparison.misfit import Misfit, misfit, pooled
from core.description import BuildingDescription
from core.effects import EFFECTS
from core.errors import CoreError, RecordError
from core.fitting.observation import Observation
from core.frozen import FrozenDict
from core.model.isolator import Isolator
from core.model.simulation import Axis, Response, respond
from core.record import Direction
from core.signals.conditioning import band_passed, without_baseline
from core.signals.noise import noise_std

UNDRIVEN = "the ground's acceleration was not measured; the model has no excitation"
"""Remark on an earthquake whose response cannot be predicted."""


@dataclass(frozen=True, slots=True, eq=False)
class Predicted:
    """One quantity, predicted from the ground motion alone, and as it was measured."""

    model: Vector
    """(n,)."""
    measured: Vector
    """(n,), of the same unit, with the same baseline and in the same band."""
    misfit: Misfit


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Response of a model in one earthquake and direction, predicted from the ground motion alone."""

    observation: Observation
    displacement: Predicted
    """m, of the isolation layer."""
    accelerations: Mapping[str, Predicted]
    """m/s², absolute, by level, the base slab's first."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """One direction of an earthquake that is to be predicted."""

    superstructure: FixedBaseModes
    """All its modes."""
    observation: Observation
    """The measurements."""
    states: Vector | None = None
    """(m,) of the model before the earthquake, as of core.comparison.compared.ForceComparison; None for zero."""


def predict(
    starts: Sequence[Start], isolator: Isolator, description: BuildingDescription, band: Band
) -> tuple[Prediction, ...]:
    """The response of building and layer to the ground motion of one earthquake, beside what was measured.

    A direction's layer sees the motion of the other one as it is predicted where both are given, and as it was measured
    where one is: then the other is not the model's, or nothing drives it.

    Displacements are about their position before the earthquake; one that was integrated, and every acceleration, is
    compared within the pass band. The noise of each error is its sensor's.

    Args:
        starts: one direction, or both.
        isolator: the model.
        description: names the levels and gives the base slab's mass.
        band: Hz.

    Raises:
        RecordError: the ground's acceleration was not measured.
        ModelError: the response grew beyond all bounds.
    """
    axes = [_axis(start) for start in starts]
    responses = respond(axes, description.base_mass, isolator, starts[0].observation.rate)
    return tuple(
        _prediction(response, start.observation, description, band)
        for response, start in zip(responses, starts, strict=True)
    )


def _axis(start: Start) -> Axis:
    observation, ground = start.observation, start.observation.ground_acceleration
    if ground is None:
        raise RecordError(f"{observation.name}: {UNDRIVEN}")
    at_rest = without_baseline(ground, observation.rate)
    return Axis(start.superstructure, at_rest, observation.conditions, start.states)


def _prediction(
    response: Response, observation: Observation, description: BuildingDescription, band: Band
) -> Prediction:
    accelerations = {
        level: _acceleration(model, measured, observation.rate, band)
        for level, measured, model in _accelerations(response, observation, description)
    }
    return Prediction(observation, _displacement(response, observation, band), FrozenDict(accelerations))


def predicted_displacement(predictions: Sequence[Prediction]) -> Misfit:
    """m, over all earthquakes."""
    return pooled([one.displacement.misfit for one in predictions])


def predicted_accelerations(predictions: Sequence[Prediction]) -> dict[str, Misfit]:
    """m/s² by level, over all earthquakes in which it was measured."""
    levels = dict.fromkeys(level for one in predictions for level in one.accelerations)
    return {
        level: pooled([one.accelerations[level].misfit for one in predictions if level in one.accelerations])
        for level in levels
    }


def _displacement(response: Response, observation: Observation, band: Band) -> Predicted:
    layer, rate = observation.layer, observation.rate
    model, measured = response.isolator_displacement, layer.displacement
    std = np.zeros(measured.size) if layer.displacement_std is None else layer.displacement_std
    if observation.transducer:
        return _predicted(model, without_baseline(measured, rate), std)
    return _predicted(band_passed(model, rate, band), band_passed(measured, rate, band), std)


def _acceleration(model: Vector, measured: Vector, rate: float, band: Band) -> Predicted:
    within = band_passed(measured, rate, band)
    noise = noise_std(within[None, :], rate)[0]
    return _predicted(band_passed(model, rate, band), within, np.full(within.size, noise))


def _predicted(model: Vector, measured: Vector, std: Vector) -> Predicted:
    return Predicted(model, measured, misfit(measured, model, std))


def _accelerations(
    response: Response, observation: Observation, description: BuildingDescription
) -> list[tuple[str, Vector, Vector]]:
    """Level, measured and predicted."""
    levels = [description.base.name, *(level.name for level in description.floors)]
    model = dict(zip(levels, [response.base_acceleration, *response.floor_acceleration], strict=True))
    return [
        (level, row, model[level]) for level, row in zip(observation.levels, observation.accelerations, strict=True)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Predictions:
    """Driven by the ground alone."""

    each: tuple[Prediction, ...]
    """Predictions in order of time, for the earthquakes and directions in which they are possible."""
    remarks: tuple[str, ...]
    """Reasons for missing predictions, and notes where a prediction uses more than the ground motion."""


def predict_all(
    forces: Sequence[ForceComparison],
    superstructures: Mapping[Direction, FixedBaseModes],
    isolator: Isolator,
    description: BuildingDescription,
    band: Band,
) -> Predictions:
    """Every earthquake, both directions of it together where the model is of both and both can be predicted.

    Args:
        forces: what was measured, and the states of the model before.
        superstructures: all modes in each direction that is known.
        isolator: the model.
        description: of the building.
        band: Hz.
    """
    starts = _starts(forces, superstructures)
    each: list[Prediction] = []
    remarks = [_called(one) + UNDRIVEN for one in forces if one.observation.ground_acceleration is None]
    for directions in starts.values():
        try:
            each += predict(directions, isolator, description, band)
        except CoreError as error:
            remarks.append(f"{directions[0].observation.name}: {error}")
    if any({"u_cross", "v_cross"} & {*EFFECTS[name].needs} for name in isolator.effects):
        remarks += [
            f"{directions[0].observation.name}: motion in the other direction is given as measured, not predicted"
            for directions in starts.values()
            if len(directions) == 1
        ]
    return Predictions(tuple(each), tuple(remarks))


def _starts(
    forces: Sequence[ForceComparison], superstructures: Mapping[Direction, FixedBaseModes]
) -> dict[datetime, list[Start]]:
    """By earthquake, in order of time."""
    starts: dict[datetime, list[Start]] = {}
    for one in sorted(forces, key=lambda one: one.observation.start):
        seen = one.observation
        if seen.ground_acceleration is not None and seen.direction in superstructures:
            starts.setdefault(seen.start, []).append(Start(superstructures[seen.direction], seen, one.states))
    return starts


def _called(one: ForceComparison) -> str:
    return f"{one.observation.name}, direction {one.observation.direction}: "
