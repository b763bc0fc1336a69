"""Comparison of a model with stored events, in a worker: values in, values out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from core.analysis import EventAnalysis, analyse
from core.arrays import Vector
from core.comparison.compared import ForceComparison
from core.comparison.failure import failure_sentences
from core.comparison.misfit import Misfit
from core.comparison.prediction import Prediction
from core.description import BuildingDescription
from core.model.isolator import Isolator
from core.workbench.comparing import failure_of
from core.workbench.earthquakes import AnalysedEarthquake, Earthquakes, Recording, analysed, joined, model_errors
from service.jobs.stages import Stage
from service.models import texts
from service.models.inputs import EventInputs, ModelEvent, WorkInputs
from service.models.model_file import Directions, ModelFile


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """An event as a model is compared with it."""

    event: ModelEvent
    earthquake: AnalysedEarthquake


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """A model compared with one event in one direction."""

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
    """A model compared with events."""

    each: tuple[Compared, ...]
    """Comparisons with the requested events."""
    fails: tuple[str, ...]
    """Sentences about the failure of the model over all events."""


def observed(inputs: WorkInputs, analyses: Sequence[EventAnalysis]) -> list[Observed]:
    """The events of a job, with the layer's motion and force in each.

    Args:
        inputs: of the job.
        analyses: the results of `observing`, and of later stages, which are left aside.
    """
    events = (*inputs.events, *inputs.unusable)
    return [
        Observed(one.event, analysed(one.event.name, analysis, _recording(inputs, one)))
        for one, analysis in zip(events, analyses, strict=False)
    ]


def _recording(inputs: WorkInputs, event: EventInputs) -> Recording:
    one = event.made_from
    return Recording(one.segments, one.description, one.settings, tuple(inputs.directions), inputs.reference)


def compared(
    isolator: Isolator, events: Sequence[Observed], description: BuildingDescription, band: tuple[float, float]
) -> Comparison:
    """The model compared with every event in every direction, driven by the measured motion and by the ground alone.

    Raises:
        ModelError: the model's force grew beyond all bounds.
        RecordError: none of the events has force and motion.
    """
    earthquakes = joined([one.earthquake for one in events], description, band)
    requested = {one.event.name: one.event for one in events if one.event.is_requested}
    errors = model_errors(isolator, earthquakes, requested.keys())
    by_observation = {id(one.observation): one for one in errors.predictions}
    each = tuple(
        _compared(requested[force.observation.name], force, by_observation.get(id(force.observation)))
        for force in errors.forces
    )
    return Comparison(each, failure_sentences(failure_of(errors)))


def stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Stages of a comparison: each event, then all of them."""
    return (
        *observing(inputs),
        Stage(
            texts.COMPARING,
            compared,
            lambda done, report_step: (inputs.isolator, observed(inputs, done), inputs.description, inputs.band),
        ),
    )


def observing(inputs: WorkInputs) -> list[Stage]:
    """Stages that analyse every event, those that cannot be used at the end; a worker keeps what it analysed."""
    return [_observing(event) for event in (*inputs.events, *inputs.unusable)]


def _observing(event: EventInputs) -> Stage:
    made_from = event.made_from
    arguments = (made_from.segments, made_from.description, made_from.settings)
    return Stage(texts.reading_event(event.event.name), analyse, lambda _, report_step: arguments, made_from.key)


def _compared(event: ModelEvent, force: ForceComparison, prediction: Prediction | None) -> Compared:
    return Compared(
        event=event.event_id,
        analysis=event.analysis_id,
        direction=force.observation.direction,
        force=force.model,
        misfit=force.misfit,
        displacement=None if prediction is None else prediction.displacement.misfit,
        accelerations={} if prediction is None else {n: p.misfit for n, p in prediction.accelerations.items()},
    )


def given(inputs: WorkInputs) -> ModelFile:
    """The version as the content of a model file."""
    direction = cast(Directions, inputs.direction)
    return ModelFile(inputs.description.code, direction, inputs.isolator, inputs.reference)


def records(inputs: WorkInputs, analyses: Sequence[EventAnalysis]) -> Earthquakes:
    """The requested events, held-out and unusable ones among them, in order of time.

    Before the first the layer is new.

    Args: as of `observed`.
    """
    seen = observed(inputs, analyses)
    requested = sorted((one for one in seen if one.event.is_requested), key=lambda one: one.event.start)
    return joined(
        [one.earthquake for one in requested],
        inputs.description,
        inputs.band,
        reference=inputs.reference,
        held_out=[one.event.name for one in requested if one.event.is_held_out],
    )
