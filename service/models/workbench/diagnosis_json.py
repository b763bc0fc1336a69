"""A diagnosis as JSON: SI units, null for what is not known."""

from collections.abc import Sequence
from typing import Any

from core.comparison.misfit import Misfit
from core.diagnosis.missing_effects import Outcome
from core.effects import EFFECTS
from service.models.workbench.candidates import Candidate
from service.models.workbench.comparison_json import events_as_json, finite, misfit_as_json, model_as_json
from service.models.workbench.diagnosing import Diagnosed
from service.models.workbench.diagnosis_words import words
from service.models.workbench.records import Records
from service.models.workbench.suspicions import as_json as suspicions_as_json
from service.models.workbench.versions import FITTED, LEFT_OUT, Version, groups
from service.version import VERSION


def as_json(found: Diagnosed) -> dict[str, Any]:
    """Outcome, what was tried, what was added, and the text."""
    diagnosis = found.diagnosis
    return finite(
        {
            "version": VERSION,
            "building": found.given.building,
            "outcome": found.outcome,
            "findings": suspicions_as_json(found.suspects),
            "candidates": [candidate_as_json(one, found.before) for one in found.candidates],
            "dropped": [{"effect": one.effect, "reason": one.reason} for one in found.dropped],
            "set": [one.effect for one in diagnosis.steps[0].alike] if diagnosis.steps else [],
            "unknown_flag": diagnosis.outcome is Outcome.UNKNOWN or diagnosis.is_unknown,
            "unexplained": {"share": diagnosis.unexplained.share, "in_noise_floors": diagnosis.unexplained.over_floor},
            "steps": [
                {
                    "effect": step.chosen.effect,
                    "family": EFFECTS[step.chosen.effect].family,
                    "delta_bic": step.chosen.delta_bic,
                    "set": [one.effect for one in step.alike],
                }
                for step in diagnosis.steps
            ],
            "versions": versions_as_json(found.versions, found.records),
            "model": model_as_json(found.model),
            "explanation": " ".join(words(found)),
            "unused": list(found.records.unused),
        }
    )


def versions_as_json(versions: Sequence[Version], records: Records) -> list[dict[str, Any]]:
    """The errors of each on what was fitted, on what was left out, and in every earthquake."""
    parted = groups(records)
    return [
        {
            "name": version.name,
            "error": misfit_as_json(version.error(parted[FITTED])),
            "error_held_out": misfit_as_json(version.error(parted[LEFT_OUT])) if LEFT_OUT in parted else None,
            "events": events_as_json(version.answers, records.left_out),
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
        "error_after_held_out": None if one.after_left_out is None else one.after_left_out.rms,
        "noise_floor": before.floor,
        "plausible": one.implausible is None,
        "reason": one.implausible,
        "parameters": {
            parameter.name: {
                "value": values[parameter.name],
                "std": one.deviations.get(parameter.name),
                "unit": parameter.unit,
            }
            for parameter in EFFECTS[one.effect].parameters
        },
    }
