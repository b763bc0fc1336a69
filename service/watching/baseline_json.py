"""A baseline as JSON and back: what is expected can be asked at any amplitude and temperature without a new fit."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from core.drift.baseline import Baseline
from core.drift.design import Design
from core.drift.scatter import Scatter
from core.drift.watched import quantity


def written(baseline: Baseline) -> dict[str, Any]:
    """As values that JSON can hold."""
    return {
        "events": list(baseline.events),
        "design": asdict(baseline.design) | {"quantity": baseline.design.quantity.name},
        "coefficients": baseline.coefficients.tolist(),
        "covariance": baseline.covariance.tolist(),
        "scatter": asdict(baseline.scatter),
        "wanted": baseline.wanted,
    }


def read(document: Mapping[str, Any]) -> Baseline:
    """The baseline that was written."""
    design: dict[str, Any] = document["design"]
    return Baseline(
        events=tuple(document["events"]),
        design=Design(**{**design, "quantity": quantity(design["quantity"])}),
        coefficients=np.array(document["coefficients"]),
        covariance=np.array(document["covariance"]),
        scatter=Scatter(**document["scatter"]),
        wanted=document["wanted"],
    )
