"""A fit as JSON: SI units, null for what is not known."""

from typing import Any

from service.models.workbench.comparison_json import events_as_json, finite, model_as_json
from service.models.workbench.fit_words import words
from service.models.workbench.refit import Refit
from service.models.workbench.versions import gain
from service.version import VERSION


def as_json(found: Refit) -> dict[str, Any]:
    """Values, covariance, outcome, and the errors before and after."""
    fit = found.fit
    before, after = found.versions
    return finite(
        {
            "version": VERSION,
            "building": found.model.building,
            "model": model_as_json(found.model),
            "outcome": fit.outcome.name.lower(),
            "undetermined": [list(key) for key in fit.undetermined],
            "covariance": {
                "parameters": [list(key) for key in fit.free],
                "matrix": (fit.covariance * found.inflation).tolist(),
            },
            "before": events_as_json(before.answers, found.records.left_out),
            "after": events_as_json(after.answers, found.records.left_out),
            "explanation": " ".join([*words(fit, found.inflation), *gain(before, after, found.records)]),
            "unused": list(found.records.unused),
        }
    )
