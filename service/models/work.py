"""What is computed of models, elsewhere: values in, values out; the one place of the service that asks core for it."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from core.analysis import EventAnalysis, analyse
from core.arrays import Vector
from core.building import FixedBaseModes
from core.comparison.compared import ForceComparison, compare_forces
from core.comparison.failure import failure
from core.comparison.failure_words import words
from core.comparison.misfit import Misfit
from core.comparison.prediction import Prediction
from core.comparison.predictions import predict_all
from core.description import BuildingDescription
from core.errors import IdentificationError
from core.fitting.observation import Observation, observations
from core.model.isolator import Isolator
from core.record import Direction
from core.restoring_force.estimator import RestoringForce
from core.restoring_force.known_superstructure import known_superstructure
from service.jobs.stages import Stage
from service.models.inputs import EventInputs, HeldEvent, WorkInputs


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """An event as a model is held against it."""

    event: HeldEvent
    analysis: EventAnalysis
    seen: tuple[tuple[Observation, RestoringForce], ...]
    """By direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """A model held against one event in one direction."""

    event: int
    analysis: int
    direction: str
    force: Vector
    """(n,) N, the model's."""
    misfit: Misfit
    """N, of the force."""
    displacement: Misfit | None
    """m, driven by the ground alone; None where nothing measured the ground, or the model's response has no bounds."""
    accelerations: Mapping[str, Misfit]
    """m/s², driven by the ground alone, by level."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """A model held against events."""

    each: tuple[Compared, ...]
    """Of the events that were wanted."""
    fails: tuple[str, ...]
    """Where it fails, over all of them, in words."""


def observed(event: EventInputs, directions: Sequence[str], reference: datetime) -> Observed:
    """The event analysed as it was, and what that says of the layer."""
    made_from = event.made_from
    analysis = analyse(made_from.segments, made_from.description, made_from.settings)
    found = observations(analysis, made_from.description, event.held.name, reference)
    seen = tuple(
        (one, analysis.directions[one.direction].restoring_force) for one in found if one.direction in directions
    )
    return Observed(event.held, analysis, seen)


def compared(
    isolator: Isolator, events: Sequence[Observed], description: BuildingDescription, band: tuple[float, float]
) -> Comparison:
    """The model held against every event in every direction, driven by the measured motion and by the ground alone.

    Raises:
        ModelError: the model's force grew beyond all bounds.
        RecordError: none of the events has force and motion.
    """
    forces = compare_forces(isolator, [one for event in events for one, _ in event.seen], band)
    of = {one.event.name: one.event for one in events}
    wanted = [force for force in forces if of[force.observation.name].is_wanted]
    predicted = predict_all(wanted, _superstructures(events, description), isolator, description, band)
    by_observation = {id(one.observation): one for one in predicted.each}
    each = tuple(
        _compared(of[force.observation.name], force, by_observation.get(id(force.observation))) for force in wanted
    )
    return Comparison(each, words(failure(wanted, band, np.random.default_rng(SEED))))


SEED = 1
"""Of the intervals of where a model fails: the same question has the same answer."""


def stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Of a comparison: each event, then all of them."""
    return (
        *observing(inputs),
        Stage(
            "Holding the model against every event",
            compared,
            lambda seen, tell: (inputs.isolator, seen, inputs.description, inputs.band),
        ),
    )


def observing(inputs: WorkInputs) -> list[Stage]:
    """Read every event, those that cannot be used at the end."""
    return [_observing(event, inputs) for event in (*inputs.events, *inputs.unusable)]


def _observing(event: EventInputs, inputs: WorkInputs) -> Stage:
    return Stage(f"Reading {event.held.name}", observed, lambda _, tell: (event, inputs.directions, inputs.reference))


def _superstructures(events: Sequence[Observed], description: BuildingDescription) -> dict[Direction, FixedBaseModes]:
    """All modes by direction, where the records or the design tell of them."""
    forces: dict[Direction, list[RestoringForce]] = {}
    for event in events:
        for one, force in event.seen:
            forces.setdefault(one.direction, []).append(force)
    found: dict[Direction, FixedBaseModes] = {}
    for direction, of_direction in forces.items():
        with suppress(IdentificationError):
            found[direction] = known_superstructure(of_direction, description).modes
    return found


def _compared(event: HeldEvent, force: ForceComparison, prediction: Prediction | None) -> Compared:
    return Compared(
        event=event.event_id,
        analysis=event.analysis_id,
        direction=force.observation.direction,
        force=force.model,
        misfit=force.misfit,
        displacement=None if prediction is None else prediction.displacement.misfit,
        accelerations={} if prediction is None else {n: p.misfit for n, p in prediction.accelerations.items()},
    )
