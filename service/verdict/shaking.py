"""Checks of the shaking, the floors' accelerations and the storeys' drift, from stored or just computed results."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from math import isfinite, log10
from typing import TYPE_CHECKING, Any

from core.description import BuildingDescription
from core.shaking.classes import long_period_class
from service.analyses.tables import ShakingResult
from service.verdict.checks import COVERAGE, Check, Lacking, Limits, Measured, checked
from service.verdict.limits import DRIFT, FLOOR_ACCELERATION, INTENSITY, LONG_PERIOD, level_limit

if TYPE_CHECKING:
    from core.analysis import EventAnalysis

COMPONENTS = 3
"""Components of a complete record of the ground."""
CALIBRATION = 0.05
"""Relative 95 % uncertainty of an accelerometer's gain. A choice: 2 log10(1.05) is 0.04 of intensity."""
NOT_COMPUTED = Lacking(
    reason="The analysis was made by an earlier version, which did not compute it.", remedy="Analyse the event again."
)
NO_SHAKING = Lacking(reason="No horizontal acceleration was recorded.", remedy="An accelerometer on the ground.")
NO_MOTION = Lacking(reason="The record shows no motion.", remedy="A record of the earthquake.")
ABOVE = "The ground was not recorded, and isolators reduce the shaking above them."
NO_STOREYS = Lacking(
    reason="Neither records nor the building file describe the storeys.",
    remedy="Give the stiffness of every storey in the building file.",
)
NO_HEIGHTS = Lacking(
    reason="The building file does not give the height of every storey.",
    remedy="Give height under [[level]] for every floor in the building file.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShakingFacts:
    """Measures of the shaking, and the motion of the building above the isolators."""

    intensity: Measured | Lacking
    """JMA instrumental intensity."""
    long_period: Measured | Lacking
    """m/s, which gives the class of long-period motion."""
    floor_acceleration: Measured | Lacking
    """m/s², the largest of any floor."""
    drift: Measured | Lacking
    """Drift over height, the largest of any storey."""


def lacking(why: Lacking) -> ShakingFacts:
    """Nothing is known, for one reason."""
    return ShakingFacts(intensity=why, long_period=why, floor_acceleration=why, drift=why)


def of_result(result: ShakingResult | None, description: BuildingDescription) -> ShakingFacts:
    """The facts of a stored analysis."""
    if result is None:
        return lacking(NOT_COMPUTED)
    doubt = "" if result.is_below_isolators else ABOVE
    remedy = "" if result.is_below_isolators else NO_SHAKING.remedy
    where = f"unofficial, {'ground' if result.is_below_isolators else result.level}, {_listed(result.components)}"
    return ShakingFacts(
        intensity=NO_MOTION
        if result.intensity is None
        else Measured(
            value=result.intensity,
            uncertainty=2 * log10((1 + CALIBRATION) * (COMPONENTS / len(result.components)) ** 0.5),
            note=where,
            doubt=doubt,
            remedy=remedy,
        ),
        long_period=Measured(
            value=result.long_period_velocity,
            uncertainty=_long_period_uncertainty(result),
            note=f"class {long_period_class(result.long_period_velocity)}, {where}",
            doubt=doubt,
            remedy=remedy,
        ),
        floor_acceleration=_largest_acceleration(result.floors),
        drift=_largest_drift(result.storeys, description),
    )


def of_analysis(event: "EventAnalysis", description: BuildingDescription) -> ShakingFacts:
    """The facts of an analysis that is not stored."""
    measured = event.shaking
    if measured is None:
        return lacking(NO_SHAKING)
    return of_result(
        ShakingResult(
            level=measured.level,
            is_below_isolators=measured.is_below_isolators,
            components=list(measured.components),
            intensity=measured.intensity if isfinite(measured.intensity) else None,
            long_period_velocity=measured.long_period_velocity,
            floors=[asdict(one) for motion in event.floors for one in motion.accelerations],
            storeys=[asdict(one) for motion in event.floors for one in motion.storeys],
        ),
        description,
    )


def shaking_checks(facts: ShakingFacts, limits: Mapping[str, Limits | Lacking]) -> Iterator[Check]:
    """Each of the facts against its limits."""
    yield checked(DRIFT, facts.drift, limits[DRIFT])
    yield checked(FLOOR_ACCELERATION, facts.floor_acceleration, limits[FLOOR_ACCELERATION], unit="m/s²")
    yield checked(INTENSITY, facts.intensity, limits[INTENSITY])
    yield checked(LONG_PERIOD, facts.long_period, limits[LONG_PERIOD], unit="m/s")


def first_to_inspect_shaking(
    limits: Mapping[str, Limits | Lacking], description: BuildingDescription
) -> Mapping[str, float]:
    """Smallest value that leads to an inspection, by column of ShakingResult."""
    lowest = min((level.height for level in description.floors if level.height is not None), default=None)
    drift = level_limit(limits, DRIFT)
    values = {
        "peak_floor_acceleration": level_limit(limits, FLOOR_ACCELERATION),
        "peak_storey_displacement": None if drift is None or lowest is None else drift * lowest,
        "intensity": level_limit(limits, INTENSITY),
        "long_period_velocity": level_limit(limits, LONG_PERIOD),
    }
    return {name: value for name, value in values.items() if value is not None}


def _listed(components: Iterable[str]) -> str:
    names = list(components)
    missing = [name for name in ("x", "y", "z") if name not in names]
    there = ", ".join(names)
    return f"{there} without {' and '.join(missing)}" if missing else there


def _long_period_uncertainty(result: ShakingResult) -> float:
    """m/s; a missing horizontal component may be as strong as the other."""
    both = {"x", "y"} <= set(result.components)
    return result.long_period_velocity * (CALIBRATION if both else (1 + CALIBRATION) * 2**0.5 - 1)


def _largest_acceleration(floors: Iterable[Mapping[str, Any]]) -> Measured | Lacking:
    """The floor whose acceleration may be the largest, upper end of its interval first."""
    known = [(one["peak"], _of_peak(one["peak"], one["std"]), one) for one in floors]
    if not known:
        return NO_SHAKING
    value, u, one = max(known, key=lambda of: of[0] + (of[1] or 0.0))
    where = f"{one['level']}, direction {one['direction']}"
    return Measured(value=value, uncertainty=u, note=where if one["is_measured"] else f"{where}, estimated")


def _of_peak(peak: float, std: float | None) -> float | None:
    return None if std is None else ((COVERAGE * std) ** 2 + (CALIBRATION * peak) ** 2) ** 0.5


def _largest_drift(storeys: Iterable[Mapping[str, Any]], description: BuildingDescription) -> Measured | Lacking:
    """The storey whose drift over height may be the largest."""
    heights = {level.name: level.height for level in description.floors}
    each = list(storeys)
    if not each:
        return NO_STOREYS
    ratios = [(one, height) for one in each if (height := heights.get(one["level"])) is not None]
    if len(ratios) < len(each):
        return NO_HEIGHTS
    one, height = max(ratios, key=lambda of: (of[0]["peak"] + COVERAGE * of[0]["std"]) / of[1])
    return Measured(
        value=one["peak"] / height,
        uncertainty=COVERAGE * one["std"] / height,
        note=f"below {one['level']}, direction {one['direction']}, estimated",
    )
