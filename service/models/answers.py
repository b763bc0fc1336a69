"""API answers on a version of a model: its values, and its errors over the compared events."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import inf, isfinite, sqrt
from typing import Any

from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit, pooled
from core.effect import Parameter
from core.effects import EFFECTS
from service.analyses.schema import FindingOut
from service.models import queries, trend as model_trend
from service.models.diagnosis_schema import DiagnosisOut, DiagnosisRow
from service.models.schema import (
    ComparisonOut,
    ComparisonRow,
    ErrorOut,
    Errors,
    ModelOut,
    ModelRow,
    Trend,
    TrendRow,
    ValueOut,
)
from service.models.tables import ModelComparison, ModelDiagnosis, ModelVersion
from service.models.trend import Held, Judged
from service.records.tables import Event

Compared = Sequence[tuple[ModelComparison, Event]]
ROLES = ("fitted", "left_out", "later")


def rows(session: Session, models: Sequence[ModelVersion]) -> list[ModelRow]:
    """Versions as a list has them."""
    compared = queries.latest_comparisons(session, [model.id for model in models])
    return [ModelRow(**_row(model, compared[model.id])) for model in models]


def whole(session: Session, model: ModelVersion) -> ModelOut:
    """A version and all that is known of it."""
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
        left_out=_events(compared, "left_out"),
    )


def values(model: ModelVersion) -> list[ValueOut]:
    """Of every parameter, in the order that the effects have them; of an unknown effect as they were stored."""
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
    """Over the events of each role."""
    return Errors(**{role: _error([one for one, _ in compared if one.role == role]) for role in ROLES})


def comparison_row(comparison: ModelComparison, event: Event) -> ComparisonRow:
    """A comparison as a list has it."""
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
        floors=finite(force.noise_ratio),
        fitting_rate=finite(force.fitting_rate),
        displacement_nrmse=None if displacement is None else finite(displacement.nrmse),
        created_at=comparison.created_at,
        version=comparison.version,
    )


def comparison(found: ModelComparison, event: Event) -> ComparisonOut:
    """A comparison and all that it found."""
    levels = found.accelerations
    return ComparisonOut(
        **comparison_row(found, event).model_dump(),
        model=found.model_id,
        acceleration_nrmse=None if levels is None else {n: finite(Misfit(**m).nrmse) for n, m in levels.items()},
    )


def judged(compared: Compared) -> tuple[Judged, ...]:
    """Errors of a model version in every compared event, the earliest first."""
    return model_trend.judged(
        [
            Held(event.id, event.start, one.direction, one.role == "fitted", Misfit(**one.misfit))
            for one, event in compared
        ]
    )


def trend(model_id: int, compared: Compared) -> Trend:
    """The same, and what is to be said of it."""
    found = judged(compared)
    said = model_trend.finding(found)
    return Trend(
        model=model_id,
        items=[_trend_row(one) for one in found],
        finding=None if said is None else FindingOut.model_validate(asdict(said)),
    )


def noise_floor(found: Misfit) -> float:
    """NRMSE that a right model would have."""
    return sqrt(found.noise / found.signal) if found.signal > 0 else inf


def finite(value: float) -> float | None:
    """The number, or None where there is none: JSON knows no infinity."""
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
    found = pooled([Misfit(**one.misfit) for one in comparisons])
    return ErrorOut(
        events=len({one.event_id for one in comparisons}),
        nrmse=finite(found.nrmse),
        noise_floor=finite(noise_floor(found)),
        floors=finite(found.noise_ratio),
        fitting_rate=finite(found.fitting_rate),
    )


def _trend_row(judged: Judged) -> TrendRow:
    held = judged.held
    return TrendRow(
        event=held.event,
        event_start=held.start,
        direction=held.direction,
        fitted=held.is_fitted,
        nrmse=finite(held.misfit.nrmse),
        floors=finite(held.misfit.noise_ratio),
        excess=judged.excess,
        allowed=judged.allowed,
        missed=judged.is_missed,
    )


def _events(compared: Compared, role: str) -> list[int]:
    return list(dict.fromkeys(event.id for one, event in compared if one.role == role))


def _parameters(effect: str) -> Mapping[str, Parameter]:
    return {one.name: one for one in EFFECTS[effect].parameters} if effect in EFFECTS else {}


def _place(name: str, known: Mapping[str, Parameter]) -> tuple[int, str]:
    return (list(known).index(name) if name in known else len(known), name)


ITEMS = ("findings", "candidates", "set", "unknown_flag", "unexplained", "steps", "versions", "unused")
"""Of the document that is kept."""


def diagnosis_row(found: ModelDiagnosis) -> DiagnosisRow:
    """A diagnosis as a list has it."""
    return DiagnosisRow(**_diagnosis_values(found))


def diagnosis(found: ModelDiagnosis) -> DiagnosisOut:
    """A diagnosis and all that it found."""
    dropped = found.document.get("dropped", [])  # earlier versions of the code did not keep any
    return DiagnosisOut(**_diagnosis_values(found), dropped=dropped, **{name: found.document[name] for name in ITEMS})


def _diagnosis_values(found: ModelDiagnosis) -> dict[str, Any]:
    same = ("id", "outcome", "fitted", "left_out", "analyses", "revision_id", "author", "created_at", "version")
    return {name: getattr(found, name) for name in same} | {
        "model": found.model_id,
        "explanation": " ".join(found.sentences),
        "job": found.job_id,
    }
