"""A fit as JSON: SI units, null for what is not known."""

from typing import Any

from core.workbench.fitting import FitResult
from service.models.workbench.comparison_json import events_as_json, finite, model_as_json
from service.models.workbench.work import Work
from service.version import VERSION


def as_json(found: Work[FitResult]) -> dict[str, Any]:
    """Values, covariance, outcome, and the errors before and after."""
    result, fit = found.result, found.result.fit
    before, after = result.versions
    return finite(
        {
            "version": VERSION,
            "building": found.model.building,
            "model": model_as_json(found.model),
            "outcome": fit.outcome.name.lower(),
            "undetermined": [list(key) for key in fit.undetermined],
            "covariance": {
                "parameters": [list(key) for key in fit.free],
                "matrix": (fit.covariance * result.inflation).tolist(),
            },
            "before": events_as_json(before.errors, result.earthquakes.held_out),
            "after": events_as_json(after.errors, result.earthquakes.held_out),
            "explanation": " ".join(result.text),
            "unused": list(result.earthquakes.unused),
        }
    )
