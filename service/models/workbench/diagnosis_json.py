"""A diagnosis as JSON: SI units, null for what is not known."""

from collections.abc import Sequence
from typing import Any

from core.comparison.misfit import Misfit
from core.diagnosis.missing_effects import Outcome
from core.diagnosis.sensor_faults import BuildingFault
from core.effects import EFFECTS
from core.workbench.candidates import Candidate
from core.workbench.diagnosing import DiagnosisResult, fault_sentences, first_cause
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes, Version
from service.models.workbench.comparison_json import events_as_json, finite, misfit_as_json, model_as_json
from service.models.workbench.work import Work
from service.version import VERSION


def as_json(found: Work[DiagnosisResult]) -> dict[str, Any]:
    """Outcome, what was tried, what was added, and the text."""
    result, diagnosis = found.result, found.result.diagnosis
    return finite(
        {
            "version": VERSION,
            "building": found.given.building,
            "outcome": result.outcome,
            "findings": _faults(result.faults),
            "candidates": [candidate_as_json(one, result.before) for one in result.candidates],
            "dropped": [{"effect": one.effect, "reason": one.reason} for one in result.dropped],
            "set": [one.effect for one in diagnosis.steps[0].alike] if diagnosis.steps else [],
            "unknown_flag": diagnosis.outcome is Outcome.UNKNOWN or diagnosis.is_unknown,
            "unexplained": {"share": diagnosis.unexplained.share, "in_noise_floors": diagnosis.unexplained.noise_ratio},
            "steps": [
                {
                    "effect": step.chosen.effect,
                    "family": EFFECTS[step.chosen.effect].family,
                    "delta_bic": step.chosen.delta_bic,
                    "set": [one.effect for one in step.alike],
                }
                for step in diagnosis.steps
            ],
            "versions": versions_as_json(result.versions, result.earthquakes),
            "model": model_as_json(found.model),
            "explanation": " ".join(result.text),
            "unused": list(result.earthquakes.unused),
        }
    )


def versions_as_json(versions: Sequence[Version], earthquakes: Earthquakes) -> list[dict[str, Any]]:
    """Errors of each version on fitted and held-out earthquakes, and in every earthquake."""
    groups = earthquakes.groups
    return [
        {
            "name": version.name,
            "error": misfit_as_json(version.error(groups[FITTED])),
            "error_held_out": misfit_as_json(version.error(groups[HELD_OUT])) if HELD_OUT in groups else None,
            "events": events_as_json(version.errors, earthquakes.held_out),
        }
        for version in versions
    ]


def candidate_as_json(one: Candidate, before: Misfit) -> dict[str, Any]:
    """An effect that was tried.

    Args:
        one: the effect.
        before: N, of the model without it.
    """
    values = one.fit.model.effects[one.effect]
    return {
        "effect": one.effect,
        "family": one.family,
        "delta_bic": one.delta_bic,
        "error_before": before.rms,
        "error_after": one.after.rms,
        "error_after_held_out": None if one.after_held_out is None else one.after_held_out.rms,
        "noise_floor": one.after.floor,
        "plausible": one.implausible is None,
        "reason": one.implausible,
        "parameters": {
            parameter.name: {
                "value": values[parameter.name],
                "std": one.std.get(parameter.name),
                "unit": parameter.unit,
            }
            for parameter in EFFECTS[one.effect].parameters
        },
    }


def without_earthquakes(building: str, found: Sequence[BuildingFault], unused: Sequence[str]) -> dict[str, Any]:
    """A diagnosis that ends with faults of the sensors, since no record can be used."""
    cause = first_cause(found)
    return finite(
        {
            "version": VERSION,
            "building": building,
            "outcome": None if cause is None else cause.value,
            "findings": _faults(found),
            "candidates": [],
            "dropped": [],
            "set": [],
            "unknown_flag": False,
            "steps": [],
            "explanation": " ".join(fault_sentences(found)),
            "unused": list(unused),
        }
    )


def _faults(found: Sequence[BuildingFault]) -> list[dict[str, Any]]:
    return [
        {
            "cause": one.cause.value,
            "kind": one.kind,
            "channel": one.channel,
            "value": one.value,
            "std": one.std,
            "message": one.message,
        }
        for one in found
    ]
