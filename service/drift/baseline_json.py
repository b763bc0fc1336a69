"""A baseline as JSON and back: what is expected can be asked at any amplitude and temperature without a new fit."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from core.drift.baseline import Baseline, BaselineModel
from core.drift.quantities import quantity
from core.drift.scatter import Scatter


def written(baseline: Baseline) -> dict[str, Any]:
    """As values that JSON can hold."""
    return {
        "events": list(baseline.events),
        "design": asdict(baseline.model) | {"quantity": baseline.model.quantity.name},
        "coefficients": baseline.coefficients.tolist(),
        "covariance": baseline.covariance.tolist(),
        "scatter": asdict(baseline.scatter),
        "wanted": baseline.events_needed,
    }


def read(document: Mapping[str, Any]) -> Baseline:
    """The baseline that was written."""
    design: dict[str, Any] = document["design"]
    return Baseline(
        events=tuple(document["events"]),
        model=BaselineModel(**{**design, "quantity": quantity(design["quantity"])}),
        coefficients=np.array(document["coefficients"]),
        covariance=np.array(document["covariance"]),
        scatter=Scatter(**document["scatter"]),
        events_needed=document["wanted"],
    )
