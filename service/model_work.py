"""What is computed of models, elsewhere: values in, values out; the one place of the service that asks core for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from core.analysis import analyse
from core.arrays import Vector
from core.comparison import ForceComparison, compare_forces
from core.description import BuildingDescription
from core.errors import IdentificationError
from core.estimator import RestoringForce
from core.isolator import Isolator
from core.known_superstructure import KnownSuperstructure, known_superstructure
from core.misfit import Misfit
from core.observation import Observation, observations
from core.prediction import Prediction, predict
from service.model_inputs import EventInputs, WorkInputs
from service.stages import Stage


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """An event as a model is held against it."""

    event: int
    """Its number."""
    analysis: int
    role: str
    seen: tuple[tuple[Observation, RestoringForce], ...]
    """By direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """A model held against one event in one direction."""

    event: int
    analysis: int
    role: str
    direction: str
    force: Vector
    """(n,) N, the model's."""
    misfit: Misfit
    """N, of the force."""
    displacement: Misfit | None
    """m, driven by the ground alone; None where nothing measured the ground."""
    accelerations: dict[str, Misfit]
    """m/s², driven by the ground alone, by level."""


def observed(event: EventInputs, directions: Sequence[str], reference: datetime) -> Observed:
    """The event analysed as it was, and what that says of the layer."""
    made_from = event.made_from
    analysis = analyse(made_from.segments, made_from.description, made_from.settings)
    found = observations(analysis, made_from.description, event.name, reference)
    seen = tuple(
        (one, analysis.directions[one.direction].restoring_force) for one in found if one.direction in directions
    )
    return Observed(event.event_id, event.analysis_id, event.role, seen)


def compared(
    isolator: Isolator, events: Sequence[Observed], description: BuildingDescription, band: tuple[float, float]
) -> tuple[Compared, ...]:
    """The model held against every event in every direction, driven by the measured motion and by the ground alone."""
    known = {one: _superstructure(events, description, one) for one in _directions(events)}
    return tuple(
        _compared(event, force, _predicted(known[one.direction], isolator, one, description, band))
        for event in events
        for one, _ in event.seen
        for force in compare_forces(isolator, [one], band)
    )


def stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Of a comparison: each event, then all of them."""
    return (
        *observing(inputs),
        Stage(
            "Holding the model against every event",
            compared,
            lambda seen: (inputs.isolator, seen, inputs.description, inputs.band),
        ),
    )


def observing(inputs: WorkInputs) -> list[Stage]:
    """Read every event."""
    return [_observing(event, inputs) for event in inputs.events]


def _observing(event: EventInputs, inputs: WorkInputs) -> Stage:
    return Stage(f"Reading {event.name}", observed, lambda _: (event, inputs.directions, inputs.reference))


def _directions(events: Sequence[Observed]) -> set[str]:
    return {one.direction for event in events for one, _ in event.seen}


def _superstructure(
    events: Sequence[Observed], description: BuildingDescription, direction: str
) -> KnownSuperstructure | None:
    """None where neither the records nor the design tell of it."""
    forces = [force for event in events for one, force in event.seen if one.direction == direction]
    try:
        return known_superstructure(forces, description)
    except IdentificationError:
        return None


def _predicted(
    known: KnownSuperstructure | None,
    isolator: Isolator,
    observation: Observation,
    description: BuildingDescription,
    band: tuple[float, float],
) -> Prediction | None:
    if known is None or observation.ground_acceleration is None:
        return None
    return predict(known.modes, isolator, observation, description, band)


def _compared(event: Observed, force: ForceComparison, prediction: Prediction | None) -> Compared:
    return Compared(
        event=event.event,
        analysis=event.analysis,
        role=event.role,
        direction=force.observation.direction,
        force=force.model,
        misfit=force.misfit,
        displacement=None if prediction is None else prediction.displacement.misfit,
        accelerations={} if prediction is None else {n: p.misfit for n, p in prediction.accelerations.items()},
    )
