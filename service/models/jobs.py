"""Jobs on a version of a model: fit, addition of an effect, diagnosis, sketch. A fit or addition makes the next
version."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from typing import Any

from sqlalchemy.orm import Session

from core import workbench
from core.analysis import EventAnalysis
from core.effects import EFFECTS, only
from core.workbench.earthquakes import Earthquakes
from core.workbench.sketching import NAME
from service.jobs.queue import Claim
from service.jobs.stages import ReportStep, Stage
from service.jobs.tables import Job
from service.models import documents, store, texts
from service.models.comparing import Comparison, compared, given, observed, observing, records
from service.models.inputs import FITTED, HELD_OUT, WorkInputs
from service.models.model_file import ModelFile
from service.models.operations import add, diagnose, fit, improve
from service.models.results import as_json
from service.models.sketch_results import document as sketch_document
from service.models.store import Draft
from service.models.tables import DiagnosisPicture, ModelDiagnosis, ModelVersion
from service.version import VERSION

STORED = 600
"""Samples of the missing force in one earthquake that a stored sketch has."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A version to be made."""

    model: ModelFile
    outcome: str
    """Outcome of the fit, and the parameters that it could not determine."""
    document: Mapping[str, Any]
    """All numbers, as JSON."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One chart of a diagnosis."""

    title: str
    caption: str
    spec: Mapping[str, Any]
    """Specification for Vega-Lite."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """The result of a diagnosis."""

    outcome: str
    sentences: tuple[str, ...]
    document: Mapping[str, Any]
    """All numbers, as JSON."""
    pictures: tuple[Picture, ...]


def fitted(model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Fitted:
    """The same effects at the values that fit the events best.

    Raises:
        RecordError: no event is left to fit to.
        ModelError: the model's force grew beyond all bounds.
    """
    done = fit(model, parent, events, report_step)
    return Fitted(done.model, " ".join(done.result.fit_text), as_json(documents.fit(done)))


def extended(effect: str, model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Fitted:
    """The model with one more effect, everything fitted to the events; errors as of `fitted`."""
    done = add(effect, model, parent, events, report_step)
    return Fitted(done.model, " ".join(done.result.fit_text), as_json(documents.extension(done)))


def improved(model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Fitted:
    """The model with the effects that diagnoses and earthquakes left out support; errors as of `fitted`."""
    done = improve(model, parent, events, report_step)
    return Fitted(done.model, " ".join(done.result.ending_text), as_json(documents.improvement(done)))


def diagnosed(model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Diagnosis:
    """Every effect that the model does not have, added to it and fitted to the events; errors as of `fitted`."""
    done = diagnose(model, parent, events, report_step)
    from service.models.figures import diagnosis_figures  # slow to import

    drawn = tuple(
        Picture(figure.title, figure.caption, picture.to_dict(validate=False))
        for figure in diagnosis_figures(done.result)
        for picture in figure.pictures
    )
    return Diagnosis(done.result.outcome, done.result.text, as_json(documents.diagnosis(done)), drawn)


def sketched(name: str | None, model: ModelFile, events: Earthquakes, report_step: ReportStep) -> Mapping[str, Any]:
    """The sketch of what a model lacks, as JSON; its effect is unknown again afterwards. Errors as of `fitted`."""
    unused = name or next(one for n in count(1) if (one := NAME if n == 1 else f"{NAME}_{n}") not in EFFECTS)
    with only(EFFECTS):
        result = workbench.sketch(model.isolator, events, name=unused, progress=report_step)
        return as_json(sketch_document(model, result, STORED))


def fit_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Stages of a fit: each event, the fit, then both versions against all events."""
    fitting = Stage(texts.FITTING, fitted, lambda done, report_step: _arguments(inputs, done, report_step), weight=2)
    return _stages(inputs, fitting)


def extension_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Stages of an addition: each event, the fit with the effect, then both versions against all events."""
    effect = inputs.arguments["effect"]
    fitting = Stage(
        texts.fitting_with(effect),
        extended,
        lambda done, report_step: (effect, *_arguments(inputs, done, report_step)),
        weight=2,
    )
    return _stages(inputs, fitting)


def improvement_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Stages of an improvement: each event, the improvement, then both versions against all events."""
    improving = Stage(
        texts.IMPROVING, improved, lambda done, report_step: _arguments(inputs, done, report_step), weight=40
    )
    return _stages(inputs, improving)


def diagnosis_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Stages of a diagnosis: each event, then every effect."""
    diagnosing = Stage(
        texts.DIAGNOSING, diagnosed, lambda done, report_step: _arguments(inputs, done, report_step), weight=20
    )
    return (*observing(inputs), diagnosing)


def sketch_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Stages of a sketch: each event, then the search."""
    sketching = Stage(
        texts.SKETCHING,
        sketched,
        lambda done, report_step: (
            inputs.arguments.get("name"),
            given(inputs),
            records(inputs, done),
            report_step,
        ),
        weight=20,
    )
    return (*observing(inputs), sketching)


def _arguments(
    inputs: WorkInputs, analyses: Sequence[EventAnalysis], report_step: ReportStep
) -> tuple[ModelFile, str, Earthquakes, ReportStep]:
    return given(inputs), f"model {inputs.model_id}", records(inputs, analyses), report_step


def _stages(inputs: WorkInputs, fitting: Stage) -> Sequence[Stage]:
    number = len(inputs.events)

    def with_events(model: Any, done: Sequence[Any]) -> tuple[Any, ...]:  # noqa: ANN401  a computation's arguments
        return model, observed(inputs, done), inputs.description, inputs.band

    return (
        *observing(inputs),
        fitting,
        Stage(texts.COMPARING_GIVEN, compared, lambda done, report_step: with_events(inputs.isolator, done)),
        Stage(
            texts.COMPARING_MADE,
            compared,
            lambda done, report_step: with_events(done[number].model.isolator, done),
        ),
    )


def store_fit(session: Session, claim: Claim, inputs: WorkInputs, done: Sequence[Any], now: datetime) -> None:
    """The next version, its errors, and those of the one it came from."""
    _store(session, claim, inputs, done, _change(inputs), now)


def store_extension(session: Session, claim: Claim, inputs: WorkInputs, done: Sequence[Any], now: datetime) -> None:
    """The version with the effect, its errors, and those of the one it came from."""
    _store(session, claim, inputs, done, _change(inputs, inputs.arguments["effect"]), now)


def store_improvement(session: Session, claim: Claim, inputs: WorkInputs, done: Sequence[Any], now: datetime) -> None:
    """The improved version, its errors, and those of the one it came from."""
    made: Fitted = done[-3]
    _store(session, claim, inputs, done, _change(inputs, ", ".join(made.document["taken"]) or None), now)


def store_diagnosis(session: Session, claim: Claim, inputs: WorkInputs, done: Sequence[Any], now: datetime) -> None:
    """The diagnosis and its pictures, with what it was made from."""
    result: Diagnosis = done[-1]
    job, requested = session.get_one(Job, claim.job_id), [one.event for one in inputs.events if one.event.is_requested]
    stored = ModelDiagnosis(
        model_id=inputs.model_id,
        job_id=claim.job_id,
        revision_id=inputs.revision_id,
        author=job.asked_by or session.get_one(ModelVersion, inputs.model_id).author,
        created_at=now,
        version=VERSION,
        fitted=[one.event_id for one in requested if not one.is_held_out],
        held_out=[one.event_id for one in requested if one.is_held_out],
        analyses=[one.analysis_id for one in (*requested, *(one.event for one in inputs.unusable))],
        outcome=result.outcome,
        sentences=list(result.sentences),
        document=dict(result.document),
        pictures=[
            DiagnosisPicture(title=one.title, caption=one.caption, spec=dict(one.spec)) for one in result.pictures
        ],
    )
    session.add(stored)
    session.flush()
    job.result = {"diagnosis": stored.id}


def store_sketch(session: Session, claim: Claim, inputs: WorkInputs, done: Sequence[Any], now: datetime) -> None:
    """The sketch, as the job's result."""
    session.get_one(Job, claim.job_id).result = {"sketch": dict(done[-1])}


def _store(session: Session, claim: Claim, inputs: WorkInputs, done: Sequence[Any], change: str, now: datetime) -> None:
    result: tuple[Fitted, Comparison, Comparison] = (done[-3], done[-2], done[-1])
    fit, before, after = result
    parent, job = session.get_one(ModelVersion, inputs.model_id), session.get_one(Job, claim.job_id)
    draft = Draft(
        direction=parent.direction,
        isolator=fit.model.isolator,
        change=change,
        author=job.asked_by or parent.author,
        revision_id=inputs.revision_id,
        parent_id=parent.id,
        reference=fit.model.reference,
        standard_deviations=fit.model.standard_deviations,
        outcome=fit.outcome,
    )
    made = store.add(session, parent.building_id, draft, now)
    roles = {one.event.event_id: HELD_OUT if one.event.is_held_out else FITTED for one in inputs.events}
    store.add_comparisons(session, parent.id, before.each, inputs.roles, now)
    store.add_comparisons(session, made.id, after.each, roles, now)
    job.result = {"made": made.id, "fails": list(after.fails), "fit": dict(fit.document)}


def _change(inputs: WorkInputs, added: str | None = None) -> str:
    held_out = sum(one.event.is_held_out for one in inputs.events)
    return texts.fitted_to(sum(one.event.is_requested for one in inputs.events) - held_out, held_out, added)
