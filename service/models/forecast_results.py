"""Forecasts as documents: one schema for the command's files, the API and the pages. SI units."""

from collections.abc import Iterator, Sequence

import numpy as np
from pydantic import Field

from core.forecasting.response import Course, Forecast, Peak
from service.documents.thinning import extremes
from service.models.forecasting import Forecasts
from service.models.results import Head, ModelValues, Result, Value
from service.verdict.checks import Check
from service.verdict.texts import title

POINTS = 600
"""Points of a history in a document: its smallest and largest values in as many parts of the time."""


class PeakOut(Result):
    """Largest absolute value of one quantity, with its 95 % interval."""

    quantity: str = Field(
        description="`displacement` of the isolation layer in m, absolute `acceleration` of a level in m/s², or "
        "`drift` of a storey in m."
    )
    level: str = Field(description="Level; of a drift, the floor above the storey; empty for the isolation layer.")
    direction: str = Field(description="x or y; xy for the displacement in plan.")
    value: Value = Field(description="Forecast.")
    low: Value = Field(description="Lower end of the 95 % interval.")
    high: Value = Field(description="Upper end of the 95 % interval.")
    by_values: Value = Field(description="Relative standard deviation by the covariance of the model's values.")
    by_model: Value = Field(description="Relative standard deviation by the model's own error in the records.")


class MarginOut(Result):
    """A limit, and how near the forecast comes to it."""

    level: str = Field(description="`watch`, `inspect` or `act`.")
    limit: Value = Field(description="In the unit of the check.")
    share: Value = Field(description="Forecast over limit; null without a forecast.")
    share_high: Value = Field(description="Upper end of the forecast's 95 % interval over limit; null without one.")


class LimitOut(Result):
    """A forecast value against the building's limits."""

    check: str = Field(description="Name of the check, as in verdicts.")
    title: str = Field(description="The same for people.")
    unit: str = Field(description="SI unit of value and limits; 1 for a share.")
    value: Value = Field(description="Forecast; null where it is not known.")
    uncertainty: Value = Field(description="95 %; null where it is not known.")
    outcome: str = Field(description="`passed`, `exceeded` or `undecided`.")
    leads_to: str = Field(description="Level that the check alone leads to.")
    reason: str = Field(description="Why it is undecided; empty otherwise.")
    remedy: str = Field(description="What would settle it; empty otherwise.")
    source: str = Field(description="Source of the limits.")
    margins: list[MarginOut] = Field(description="Each limit, rising.")


class HistoryOut(Result):
    """Displacement of the isolation layer over time, thinned to its extremes."""

    direction: str
    time: list[Value] = Field(description="s since the motion begins.")
    displacement: list[Value] = Field(description="m.")
    std: list[Value] = Field(description="m, standard deviation by the covariance of the model's values.")


class ForecastOut(Result):
    """Response of the building to one ground motion."""

    motion: str = Field(description="Name of the ground motion.")
    factor: Value = Field(description="By which the motion was multiplied.")
    pga: Value = Field(description="m/s², of the stronger horizontal component, scaled.")
    out_of_range: bool = Field(description="True if the motion leaves the range that the model has seen.")
    beyond: list[str] = Field(description="Why it does.")
    remarks: list[str] = Field(description="Assumptions.")
    peaks: list[PeakOut]
    limits: list[LimitOut] = Field(description="The response against the limits of the building file.")
    histories: list[HistoryOut] = Field(description="By direction.")


class ForecastDocument(Head):
    """Forecasts of a model."""

    model: ModelValues
    fitted_to: list[str] = Field(default=[], description="Names of the earthquakes that the model was fitted to.")
    known_from: list[str] = Field(description="Names of the earthquakes that the model's error is known from.")
    displacement: Value = Field(description="m, largest of the layer in the records that the model was fitted to.")
    velocity: Value = Field(description="m/s, the same.")
    last: str = Field(description="End of the last record.")
    forecasts: list[ForecastOut]
    remarks: list[str] = Field(description="Sources of the superstructure.")
    unused: list[str] = Field(description="Records that could not be used, with the reason.")


def document(done: Forecasts) -> ForecastDocument:
    """Forecasts as a document."""
    result = done.result
    each = zip(result.forecasts, done.checks, strict=True)
    return ForecastDocument(
        building=done.given.building,
        model=ModelValues.of(done.given),
        fitted_to=list(result.earthquakes.fitted_names),
        known_from=list(dict.fromkeys(one.name for one in result.earthquakes.observations)),
        displacement=result.experience.displacement,
        velocity=result.experience.velocity,
        last=f"{result.experience.last:%Y-%m-%dT%H:%M:%SZ}",
        forecasts=[_forecast(one, checks) for one, checks in each],
        remarks=list(result.sources),
        unused=list(result.earthquakes.unused),
    )


def _forecast(one: Forecast, checks: Sequence[Check]) -> ForecastOut:
    return ForecastOut(
        motion=one.motion.name,
        factor=one.factor,
        pga=one.motion.pga,
        out_of_range=one.is_out_of_range,
        beyond=list(one.beyond),
        remarks=list(one.remarks),
        peaks=[_peak(peak) for peak in one.peaks],
        limits=[_limit(check) for check in checks],
        histories=[_history(direction, course, one.rate) for direction, course in one.courses.items()],
    )


def _peak(peak: Peak) -> PeakOut:
    return PeakOut.model_validate(peak)


def _limit(check: Check) -> LimitOut:
    return LimitOut(
        check=check.name,
        title=title(check),
        unit=check.unit,
        value=check.value,
        uncertainty=check.uncertainty,
        outcome=check.outcome.value,
        leads_to=check.level.value,
        reason=check.reason,
        remedy=check.remedy,
        source="" if check.limits is None else check.limits.source,
        margins=list(_margins(check)),
    )


def _margins(check: Check) -> Iterator[MarginOut]:
    if check.limits is None:
        return
    for level, limit in check.limits:
        size = None if check.value is None else abs(check.value)
        high = None if size is None or check.uncertainty is None else size + check.uncertainty
        yield MarginOut(
            level=level.value,
            limit=limit,
            share=None if size is None else size / limit,
            share_high=None if high is None else high / limit,
        )


def _history(direction: str, course: Course, rate: float) -> HistoryOut:
    moved = course.response.isolator_displacement
    kept = np.unique(extremes(moved, POINTS))
    return HistoryOut(
        direction=direction,
        time=[float(at) for at in kept / rate],
        displacement=[float(one) for one in moved[kept]],
        std=[float(one) for one in course.displacement_std[kept]],
    )
