"""Rows of versions, comparisons and diagnoses as answers of the API."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import inf, isfinite, sqrt
from typing import Any, cast

from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit, pooled
from core.effect import Parameter
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.isolator import Isolator
from service.analyses.schema import FindingOut
from service.errors import ConflictError
from service.jobs.tables import Job
from service.models import queries, texts, trend as model_trend
from service.models.model_file import Directions, ModelFile
from service.models.results import Findings, LeftOut, MisfitOut, PredictionOut
from service.models.schema import (
    ComparisonOut,
    ComparisonRow,
    DiagnosisOut,
    DiagnosisRow,
    ErrorOut,
    Errors,
    ModelOut,
    ModelRow,
    Trend,
    TrendRow,
    ValueOut,
)
from service.models.tables import ModelComparison, ModelDiagnosis, ModelVersion
from service.models.trend import EventError, RatedError
from service.records.tables import Event

Compared = Sequence[tuple[ModelComparison, Event]]
ROLES = ("fitted", "held_out", "later")


def rows(session: Session, models: Sequence[ModelVersion]) -> list[ModelRow]:
    """Versions in a list."""
    compared = queries.latest_comparisons(session, [model.id for model in models])
    return [ModelRow(**_row(model, compared[model.id])) for model in models]


def whole(session: Session, model: ModelVersion) -> ModelOut:
    """A version, in full."""
    compared = queries.latest_comparisons(session, [model.id])[model.id]
    return ModelOut(
        **_row(model, compared),
        accepted_by=model.accepted_by,
        accepted_at=model.accepted_at,
        version=model.version,
        revision_id=model.revision_id,
        reference=model.reference,
        values=values(model),
        assumed=model.assumed,
        outcome=model.outcome,
        fitted_to=_events(compared, "fitted"),
        held_out=_events(compared, "held_out"),
    )


def model_file(session: Session, model: ModelVersion) -> ModelFile:
    """A version as the content of a model file.

    Raises:
        ConflictError: it names an effect that there is not.
    """
    try:
        isolator = Isolator(model.effects)
    except ModelError as error:
        raise ConflictError(texts.no_model(error)) from None
    compared = queries.latest_comparisons(session, [model.id])[model.id]
    fitted = dict.fromkeys(f"{event.start:%Y-%m-%dT%H:%M:%SZ}" for one, event in compared if one.role == "fitted")
    return ModelFile(
        building=model.building.code,
        direction=cast(Directions, model.direction),
        isolator=isolator,
        reference=model.reference,
        parent=None if model.parent_id is None else f"model {model.parent_id}",
        assumed=tuple(model.assumed),
        fitted_to=tuple(fitted),
        standard_deviations={
            effect: {name: inf if value is None else value for name, value in own.items()}
            for effect, own in model.standard_deviations.items()
        },
    )


def values(model: ModelVersion) -> list[ValueOut]:
    """Value of every parameter, in the effects' order; of an unknown effect as stored."""
    return [
        ValueOut(
            effect=effect,
            parameter=name,
            value=value,
            std=model.standard_deviations.get(effect, {}).get(name),
            unit=known[name].unit if name in known else None,
            meaning=known[name].meaning if name in known else None,
        )
        for effect, stored in model.effects.items()
        for known in (_parameters(effect),)
        for name, value in sorted(stored.items(), key=lambda item: _place(item[0], known))
    ]


def errors(compared: Compared) -> Errors:
    """Errors over the events of each role."""
    return Errors(**{role: _error([one for one, _ in compared if one.role == role]) for role in ROLES})


def errors_in_the_same_events(line: Sequence[Compared]) -> list[Errors]:
    """Errors of versions in the events that the last one was compared with, by their role for that one.

    None where a version was not compared with all events of a role: its error in other events does not show what a
    change removed.
    """
    of_last = [one for one, _ in line[-1]]

    def error(compared: Compared, role: str) -> ErrorOut | None:
        own = {(one.event_id, one.direction): one for one, _ in compared}
        same = [own.get((one.event_id, one.direction)) for one in of_last if one.role == role]
        found = [one for one in same if one is not None]
        return _error(found) if len(found) == len(same) else None

    return [Errors(**{role: error(compared, role) for role in ROLES}) for compared in line]


def comparison_row(comparison: ModelComparison, event: Event) -> ComparisonRow:
    """A comparison in a list."""
    force = Misfit(**comparison.misfit)
    displacement = None if comparison.displacement is None else Misfit(**comparison.displacement)
    return ComparisonRow(
        id=comparison.id,
        event=event.id,
        event_start=event.start,
        direction=comparison.direction,
        role=comparison.role,
        analysis=comparison.analysis_id,
        nrmse=finite(force.nrmse),
        noise_floor=finite(noise_floor(force)),
        noise_ratio=finite(force.noise_ratio),
        fitting_rate=finite(force.fitting_rate),
        displacement_nrmse=None if displacement is None else finite(displacement.nrmse),
        created_at=comparison.created_at,
        version=comparison.version,
    )


def comparison(stored: ModelComparison, event: Event) -> ComparisonOut:
    """A comparison, in full."""
    levels = None if stored.accelerations is None else {n: Misfit(**one) for n, one in stored.accelerations.items()}
    prediction = None
    if stored.displacement is not None:
        prediction = PredictionOut(
            displacement=MisfitOut.of(Misfit(**stored.displacement)),
            accelerations={name: MisfitOut.of(one) for name, one in (levels or {}).items()},
        )
    return ComparisonOut(
        **comparison_row(stored, event).model_dump(),
        model=stored.model_id,
        acceleration_nrmse=None if levels is None else {name: finite(one.nrmse) for name, one in levels.items()},
        force=MisfitOut.of(Misfit(**stored.misfit)),
        prediction=prediction,
    )


def rated(compared: Compared) -> tuple[RatedError, ...]:
    """Errors of a model version in every compared event, the earliest first."""
    return model_trend.rated(
        [
            EventError(event.id, event.start, one.direction, one.role == "fitted", Misfit(**one.misfit))
            for one, event in compared
        ]
    )


def trend(model_id: int, compared: Compared) -> Trend:
    """The same, with the finding on the latest events."""
    errors = rated(compared)
    finding = model_trend.finding(errors)
    return Trend(
        model=model_id,
        items=[_trend_row(one) for one in errors],
        finding=None if finding is None else FindingOut.model_validate(asdict(finding)),
    )


def noise_floor(misfit: Misfit) -> float:
    """NRMSE of a correct model."""
    return sqrt(misfit.noise / misfit.signal) if misfit.signal > 0 else inf


def finite(value: float) -> float | None:
    """The number, or None for an infinite one or NaN, which JSON does not have."""
    return value if isfinite(value) else None


def _row(model: ModelVersion, compared: Compared) -> dict[str, Any]:
    same = ("id", "direction", "number", "state", "change", "author", "created_at")
    return {name: getattr(model, name) for name in same} | {
        "building": model.building.code,
        "parent": model.parent_id,
        "effects": list(model.effects),
        "errors": errors(compared),
    }


def _error(comparisons: Sequence[ModelComparison]) -> ErrorOut | None:
    if not comparisons:
        return None
    every = pooled([Misfit(**one.misfit) for one in comparisons])
    return ErrorOut(
        events=len({one.event_id for one in comparisons}),
        nrmse=finite(every.nrmse),
        noise_floor=finite(noise_floor(every)),
        noise_ratio=finite(every.noise_ratio),
        fitting_rate=finite(every.fitting_rate),
    )


def _trend_row(rated: RatedError) -> TrendRow:
    error = rated.event
    return TrendRow(
        event=error.number,
        event_start=error.start,
        direction=error.direction,
        fitted=error.is_fitted,
        nrmse=finite(error.misfit.nrmse),
        noise_ratio=finite(error.misfit.noise_ratio),
        excess=rated.excess,
        allowed=rated.allowed,
        missed=rated.is_missed,
    )


def _events(compared: Compared, role: str) -> list[int]:
    return list(dict.fromkeys(event.id for one, event in compared if one.role == role))


def _parameters(effect: str) -> Mapping[str, Parameter]:
    return {one.name: one for one in EFFECTS[effect].parameters} if effect in EFFECTS else {}


def _place(name: str, known: Mapping[str, Parameter]) -> tuple[int, str]:
    return (list(known).index(name) if name in known else len(known), name)


def diagnosis_row(stored: ModelDiagnosis) -> DiagnosisRow:
    """A diagnosis in a list."""
    return DiagnosisRow(**_diagnosis_values(stored))


def diagnosis(stored: ModelDiagnosis) -> DiagnosisOut:
    """A diagnosis, in full; the document of an earlier version may lack what its schema gives a default."""
    findings = Findings.model_validate(stored.document)
    return DiagnosisOut(
        **_diagnosis_values(stored), **{name: getattr(findings, name) for name in Findings.model_fields}
    )


def _diagnosis_values(stored: ModelDiagnosis) -> dict[str, Any]:
    same = ("id", "outcome", "fitted", "held_out", "analyses", "revision_id", "author", "created_at", "version")
    return {name: getattr(stored, name) for name in same} | {
        "model": stored.model_id,
        "explanation": " ".join(stored.sentences),
        "job": stored.job_id,
    }


def improvement_steps(job: Job) -> Sequence[LeftOut]:
    """The model before and after each change of an improvement by earthquakes left out; none of other jobs."""
    stored = ((job.result or {}).get("fit") or {}).get("left_out") or ()
    return [LeftOut.model_validate(one) for one in stored] if len(stored) > 1 else []
