"""The baseline of a series: stored as JSON, and evaluated as a curve over amplitude."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from core.arrays import Vector
from core.drift.ageing import Ageing
from core.drift.baseline import Baseline, BaselineModel
from core.drift.quantities import quantity
from core.drift.scatter import Scatter
from service.drift.schema import BaselineOut, CurvePoint
from service.drift.tables import MonitoredSeries

BAND = 1.96
"""Standard deviations; 95 % of a normal variable lie within them."""
BEYOND = 1.5
"""Factor by which the curve extends beyond the amplitudes of the reference, where the band widens."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Expected values on a grid of amplitudes, in SI units."""

    amplitude: Vector | None
    """(n,) m, or N for frequencies; None with n = 1 where the quantity does not depend on amplitude."""
    expected: Vector
    """(n,) in SI units of the quantity."""
    low: Vector
    high: Vector
    """(n,) limits of the band that contains 95 % of the events' values."""
    is_seen: Vector
    """(n,) 1 within the amplitudes of the reference."""
    temperature: float | None
    """°C; None where the temperature has no known influence."""


def written(baseline: Baseline) -> dict[str, Any]:
    """A baseline as values of JSON, to be evaluated at any amplitude and temperature without a new fit."""
    return {
        "events": list(baseline.events),
        "design": asdict(baseline.model) | {"quantity": baseline.model.quantity.name},
        "coefficients": baseline.coefficients.tolist(),
        "covariance": baseline.covariance.tolist(),
        "scatter": asdict(baseline.scatter),
        "wanted": baseline.events_needed,
        "inputs": baseline.inputs,
    }


def read(document: Mapping[str, Any]) -> Baseline:
    """A baseline from the values of `written`."""
    design: dict[str, Any] = document["design"]
    if (ageing := design.get("ageing")) is not None:
        design = design | {"ageing": Ageing(**ageing)}
    return Baseline(
        events=tuple(document["events"]),
        model=BaselineModel(**{**design, "quantity": quantity(design["quantity"])}),
        coefficients=np.array(document["coefficients"]),
        covariance=np.array(document["covariance"]),
        scatter=Scatter(**document["scatter"]),
        events_needed=document["wanted"],
        inputs=document.get("inputs", ""),  # of rows from before it was stored
    )


def curve(baseline: Baseline, temperature: float | None, points: int) -> Curve:
    """The curve on a grid of amplitudes with even logarithmic spacing.

    Args:
        baseline: of the series.
        temperature: °C; None: the mean of the reference.
        points: of the grid, at least two.
    """
    mean = baseline.model.temperature
    at = None if mean is None else mean if temperature is None else temperature
    seen = baseline.range
    if seen is None:
        amplitude = np.ones(1)
        is_seen = np.ones(1)
    else:
        amplitude = np.geomspace(seen[0] / BEYOND, seen[1] * BEYOND, points)
        is_seen = ((amplitude >= seen[0]) & (amplitude <= seen[1])).astype(float)
    middle, std = baseline.expected(amplitude, at)
    ends = (middle, middle - BAND * std, middle + BAND * std)
    is_logarithmic = baseline.model.quantity.is_logarithmic
    expected, low, high = (np.exp(one) if is_logarithmic else one for one in ends)
    return Curve(None if seen is None else amplitude, expected, low, high, is_seen, at)


def baseline_answer(code: str, series: MonitoredSeries, temperature: float | None, points: int) -> BaselineOut:
    """The baseline of a series for the API; without a curve until the baseline is determined.

    Args:
        code: of the building.
        series: as last monitored.
        temperature: °C; None: the mean of the reference.
        points: amplitudes of the curve.
    """
    known = None if series.baseline is None else read(series.baseline)
    drawn = None if known is None else curve(known, temperature, points)
    lowest, highest = (None, None) if known is None or known.range is None else known.range
    return BaselineOut(
        building=code,
        quantity=series.quantity,
        subject=series.subject,
        temperature=None if drawn is None else drawn.temperature,
        lowest_amplitude=lowest,
        highest_amplitude=highest,
        reference_events=[] if known is None else list(known.events),
        wanted=series.wanted,
        items=[] if drawn is None else _curve_points(drawn),
        next=None,
    )


def _curve_points(drawn: Curve) -> list[CurvePoint]:
    return [
        CurvePoint(
            amplitude=None if drawn.amplitude is None else float(drawn.amplitude[n]),
            expected=float(drawn.expected[n]),
            low=float(drawn.low[n]),
            high=float(drawn.high[n]),
            is_seen=bool(drawn.is_seen[n]),
        )
        for n in range(drawn.expected.size)
    ]
