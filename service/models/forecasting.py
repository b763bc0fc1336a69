"""Forecasts beside the limits of the building file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from core import workbench
from core.description import BuildingDescription
from core.forecasting.ground_motion import GroundMotion, Scaling
from core.forecasting.response import Forecast, Peak
from core.shaking.classes import long_period_class
from core.shaking.intensity import instrumental_intensity, long_period_velocity
from core.workbench.earthquakes import Earthquakes
from core.workbench.forecasting import ForecastResult
from service.buildings.description import BuildingFile, GivenLimits
from service.jobs.stages import ReportStep
from service.models.model_file import ModelFile
from service.verdict.checks import Check, Lacking, Limits, Measured
from service.verdict.limits import limits_of, motion_checks
from service.verdict.shaking import NO_HEIGHTS, ShakingFacts, shaking_checks

NO_RESIDUAL = Lacking(
    reason="A forecast does not give the displacement that remains.",
    remedy="A survey of the isolators' position after the earthquake.",
)
ONE_COMPONENT = "The motion has one horizontal component; the other may be as strong."
OUT_OF_RANGE = "The motion is out of the range that the model has seen."
RECORDS = "A record of a stronger earthquake, and a fit with it."
HORIZONTAL = ("x", "y")


@dataclass(frozen=True, slots=True, eq=False)
class Forecasts:
    """Forecasts of a model file, each with the checks of its response."""

    given: ModelFile
    result: ForecastResult
    checks: tuple[tuple[Check, ...], ...]
    """By forecast."""


def forecast(
    given: ModelFile,
    records: Earthquakes,
    motions: Sequence[GroundMotion],
    building: BuildingFile,
    scaling: Scaling | None,
    at: datetime | None,
    temperature: float | None,
    report_step: ReportStep,
) -> Forecasts:
    """Forecast the response to ground motions, and check it against the building's limits.

    Args:
        given: the model.
        records: that its values were fitted to.
        motions: of the ground.
        building: with the limits.
        scaling: of every motion.
        at: start of the motions, aware; None for the end of the last record.
        temperature: °C, of the isolators; None for the middle of the records'.
        report_step: called with each step.

    Raises:
        RecordError: nothing to forecast from, or an impossible motion or scaling.
        ModelError: the model's force or response grew beyond all bounds.
    """
    result = workbench.forecast(
        given.isolator,
        records,
        motions,
        scaling=scaling,
        at=at,
        temperature=temperature,
        progress=report_step,
    )
    checks = tuple(checks_of(one, building.description, building.limits) for one in result.forecasts)
    return Forecasts(given, result, checks)


def checks_of(one: Forecast, description: BuildingDescription, given: Mapping[str, GivenLimits]) -> tuple[Check, ...]:
    """Checks of a forecast against the building's limits, as the verdict makes them of a record.

    Args:
        one: the forecast.
        description: of the building.
        given: the designer's limits, by check.
    """
    limits = limits_of(description.isolation, given)
    facts = ShakingFacts(
        intensity=_intensity(one.motion),
        long_period=_long_period(one.motion),
        floor_acceleration=_floor_acceleration(one),
        drift=_drift(one, description),
    )
    shaking: Mapping[str, Limits | Lacking] = limits
    return (
        *(check for check in motion_checks(description.isolation, limits, _displacement(one), NO_RESIDUAL)),
        *shaking_checks(facts, shaking),
    )


def _displacement(one: Forecast) -> Measured:
    lacking = [direction for direction in HORIZONTAL if direction not in one.courses]
    doubt = f"The displacement in direction {lacking[0]} is not forecast." if lacking else ""
    return _measured(one, one.peak("displacement"), 1.0, "", doubt, "A model of both directions, and a motion in both.")


def _floor_acceleration(one: Forecast) -> Measured:
    peak = max((peak for peak in one.peaks if peak.quantity == "acceleration"), key=lambda peak: peak.high)
    return _measured(one, peak, 1.0, f"{peak.level}, direction {peak.direction}")


def _drift(one: Forecast, description: BuildingDescription) -> Measured | Lacking:
    heights = {level.name: level.height for level in description.floors}
    known = [
        (peak, height) for peak in one.peaks if peak.quantity == "drift" and (height := heights[peak.level]) is not None
    ]
    if len(known) < sum(peak.quantity == "drift" for peak in one.peaks):
        return NO_HEIGHTS
    peak, height = max(known, key=lambda pair: pair[0].high / pair[1])
    return _measured(one, peak, 1 / height, f"below {peak.level}, direction {peak.direction}")


def _measured(one: Forecast, peak: Peak, factor: float, note: str, doubt: str = "", remedy: str = "") -> Measured:
    """A peak with the longer side of its interval; a motion out of range puts it in doubt."""
    return Measured(
        value=factor * peak.value,
        uncertainty=factor * max(peak.high - peak.value, peak.value - peak.low),
        note=note,
        doubt=OUT_OF_RANGE if one.is_out_of_range else doubt,
        remedy=RECORDS if one.is_out_of_range else remedy,
    )


def _intensity(motion: GroundMotion) -> Measured:
    components = np.array(list(motion.accelerations.values()))
    value = instrumental_intensity(components, motion.rate)
    lacking = 2 * float(np.log10((3 / len(components)) ** 0.5))
    return Measured(value=value, uncertainty=lacking, note=f"unofficial, {', '.join(motion.accelerations)}")


def _long_period(motion: GroundMotion) -> Measured:
    value = long_period_velocity(np.array(list(motion.horizontal.values())), motion.rate)
    doubt = ONE_COMPONENT if len(motion.horizontal) == 1 else ""
    return Measured(
        value=value,
        uncertainty=0.0,
        note=f"class {long_period_class(value)}, unofficial",
        doubt=doubt,
        remedy="A motion with both horizontal components." if doubt else "",
    )
