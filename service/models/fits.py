"""Fits of a version to events, with one more effect or without: each makes the next version."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from core.workbench.earthquakes import Earthquakes
from service.jobs.queue import Claim
from service.jobs.stages import ReportStep, Stage
from service.jobs.tables import Job
from service.models import results, versions
from service.models.inputs import FITTED, LEFT_OUT, WorkInputs
from service.models.model_file import ModelFile
from service.models.tables import ModelVersion
from service.models.versions import Draft
from service.models.work import Comparison, Observed, compared, given, observing, records
from service.models.workbench import adding_output, comparison_json
from service.models.workbench.work import add, fit


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A version to be made."""

    model: ModelFile
    outcome: str
    """How the fit ended, and what it could not determine."""
    document: Mapping[str, Any]
    """All numbers, as JSON."""


def fitted(model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Fitted:
    """The same effects at the values that the events ask for.

    Raises:
        RecordError: no event is left to fit to.
        ModelError: the model's force grew beyond all bounds.
    """
    found = fit(model, parent, events, report_step)
    return Fitted(found.model, " ".join(found.result.fit_text), comparison_json.fit_as_json(found))


def extended(effect: str, model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Fitted:
    """The model with one more effect, everything fitted to the events.

    Raises:
        RecordError: no event is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    found = add(effect, model, parent, events, report_step)
    return Fitted(found.model, " ".join(found.result.fit_text), adding_output.as_json(found))


def fit_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Number of steps of a fit: each event, the fit, then both versions against all events."""
    return _stages(
        inputs,
        Stage(
            "Fitting the model",
            fitted,
            lambda seen, report_step: (given(inputs), _parent(inputs), records(inputs, seen), report_step),
        ),
    )


def extension_stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Number of steps of an addition: each event, the fit with the effect, then both versions against all events."""
    effect = inputs.arguments["effect"]
    return _stages(
        inputs,
        Stage(
            f"Fitting the model with {effect}",
            extended,
            lambda seen, report_step: (effect, given(inputs), _parent(inputs), records(inputs, seen), report_step),
        ),
    )


def store_fit(session: Session, claim: Claim, inputs: WorkInputs, found: Sequence[Any], now: datetime) -> None:
    """The next version, its errors, and those of the one it came from."""
    _store(session, claim, inputs, found, f"fitted to {_counted(inputs)}", now)


def store_extension(session: Session, claim: Claim, inputs: WorkInputs, found: Sequence[Any], now: datetime) -> None:
    """The version with the effect, its errors, and those of the one it came from."""
    _store(session, claim, inputs, found, f"with {inputs.arguments['effect']}, fitted to {_counted(inputs)}", now)


def _stages(inputs: WorkInputs, fitting: Stage) -> Sequence[Stage]:
    count = len(inputs.events)

    def held(model: Any, seen: Sequence[Observed]) -> tuple[Any, ...]:  # noqa: ANN401  a computation's arguments
        return model, seen, inputs.description, inputs.band

    return (
        *observing(inputs),
        fitting,
        Stage(
            "Holding the model as it was against every event",
            compared,
            lambda found, report_step: held(inputs.isolator, found[:count]),
        ),
        Stage(
            "Holding the new one against every event",
            compared,
            lambda found, report_step: held(found[count].model.isolator, found[:count]),
        ),
    )


def _store(
    session: Session, claim: Claim, inputs: WorkInputs, found: Sequence[Any], change: str, now: datetime
) -> None:
    result: tuple[Fitted, Comparison, Comparison] = (found[-3], found[-2], found[-1])
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
        standard_deviations={
            (effect, name): std for effect, own in fit.model.standard_deviations.items() for name, std in own.items()
        },
        outcome=fit.outcome,
    )
    made = versions.add(session, parent.building_id, draft, now)
    results.store_comparisons(session, parent.id, before.each, inputs.roles, now)
    results.store_comparisons(session, made.id, after.each, _roles(inputs), now)
    job.result = {"made": made.id, "fails": list(after.fails), "fit": dict(fit.document)}


def _roles(inputs: WorkInputs) -> Mapping[int, str]:
    return {one.held.event_id: LEFT_OUT if one.held.is_held_out else FITTED for one in inputs.events}


def _counted(inputs: WorkInputs) -> str:
    """Number of events to which a model was fitted."""
    out = sum(one.held.is_held_out for one in inputs.events)
    count = sum(one.held.is_wanted for one in inputs.events) - out
    return f"{count} event{'s' if count > 1 else ''}" + (f", {out} left out" if out else "")


def _parent(inputs: WorkInputs) -> str:
    return f"model {inputs.model_id}"
