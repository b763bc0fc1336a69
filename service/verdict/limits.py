"""Limits of the checks: the designer's from the building file, else Menshin's defaults, each with its source.

Without a source in the literature a default is engineering judgement. Lead-rubber formulas end at a shear strain of
250 %; expansion joints allow about 50 mm for small and medium earthquakes, and isolators are to be inspected from JMA
intensity 5-lower on (JSSI); Japanese notifications limit the drift to 1/200 to 1/300; a floor acceleration of 300 gal
left a structure undamaged (Siringoringo and Fujino, 2014).
"""

from collections.abc import Mapping
from dataclasses import replace

from core.description import IsolationLayer
from core.rounding import plain
from core.shaking.classes import CLASSES
from service.buildings.description import GivenLimits
from service.verdict.checks import Check, Lacking, Limits, Measured, checked

STRAIN, DESIGN, MOAT, STROKE = "shear_strain", "design_displacement", "moat_clearance", "damper_stroke"
TRAVEL, RESIDUAL_OFFSET, REST_POSITION = "damper_travel", "residual_displacement", "rest_position"
DRIFT, FLOOR_ACCELERATION = "storey_drift", "floor_acceleration"
INTENSITY, LONG_PERIOD, STIFFNESS_CHANGE = "jma_intensity", "long_period_class", "stiffness"
DEFAULT = "Menshin's default"
TOLERANCE = 0.20
"""Relative change of stiffness beyond which the isolators are to be inspected where the maker gives no range."""
DEFAULTS: Mapping[str, Limits] = {
    STRAIN: Limits(watch=1.0, inspect=2.0, act=2.5, source=DEFAULT),
    DESIGN: Limits(watch=0.33, inspect=0.67, act=1.0, source=DEFAULT),
    MOAT: Limits(watch=0.5, inspect=0.75, act=0.9, source=DEFAULT),
    STROKE: Limits(watch=0.5, inspect=0.8, act=1.0, source=DEFAULT),
    RESIDUAL_OFFSET: Limits(watch=0.010, inspect=0.030, act=0.050, source=DEFAULT),
    REST_POSITION: Limits(watch=0.010, inspect=0.030, act=0.050, source=DEFAULT),
    DRIFT: Limits(watch=1 / 500, inspect=1 / 300, act=1 / 100, source=DEFAULT),
    FLOOR_ACCELERATION: Limits(watch=2.0, inspect=3.0, act=5.0, source=DEFAULT),
    INTENSITY: Limits(watch=3.5, inspect=4.5, source=f"{DEFAULT}; inspect by JSSI: 5-lower"),
    LONG_PERIOD: Limits(watch=CLASSES[1], inspect=CLASSES[2], source=f"{DEFAULT}; classes 2 and 3 of JMA"),
    STIFFNESS_CHANGE: Limits(watch=0.10, inspect=TOLERANCE, source=DEFAULT),
}
"""By check, in SI units."""
LENGTHS: Mapping[str, str] = {
    STRAIN: "rubber_height",
    DESIGN: "design_displacement",
    MOAT: "moat_clearance",
    STROKE: "damper_stroke",
}
"""Key of the building file whose length the displacement is divided by, by check."""
NO_TRAVEL = Lacking(
    reason="No limit of the dampers' cumulative travel is published.",
    remedy="Give damper_travel under [limits] in the building file, as the maker of the dampers states it.",
)
NO_LENGTH = Lacking(reason="The building file gives no length to compare with.", remedy="")
MM = 1e3


def limits_of(layer: IsolationLayer, given: Mapping[str, GivenLimits]) -> Mapping[str, Limits | Lacking]:
    """Limits of every check of a building; there are none of dampers where it has none.

    Args:
        layer: of the building; a check that needs a length has no limits without it.
        given: the designer's limits, by check.
    """
    known = {**DEFAULTS, **{name: _given(name, levels) for name, levels in given.items()}}
    has_dampers = layer.damper_stroke is not None or not {STROKE, TRAVEL}.isdisjoint(given)
    over_lengths = {name: _over_length(name, known[name], layer) for name in LENGTHS}
    every: Mapping[str, Limits | Lacking] = {TRAVEL: NO_TRAVEL, **known, **over_lengths}
    return {name: one for name, one in every.items() if name not in (STROKE, TRAVEL) or has_dampers}


def length_of(layer: IsolationLayer, name: str) -> float | None:
    """m, length that a check divides the displacement by; None if the building file does not give it."""
    value: float | None = getattr(layer, LENGTHS[name])
    return value


def level_limit(limits: Mapping[str, Limits | Lacking], name: str) -> float | None:
    """The limit from which on a check leads to an inspection; None where there is none."""
    one = limits.get(name)
    if not isinstance(one, Limits):
        return None
    return one.inspect if one.inspect is not None else one.act


def first_to_inspect(layer: IsolationLayer, limits: Mapping[str, Limits | Lacking]) -> float | None:
    """m, smallest displacement at which the isolators are to be inspected; None where no length is known."""
    shares = ((level_limit(limits, name), length_of(layer, name)) for name in LENGTHS)
    return min((share * length for share, length in shares if share is not None and length is not None), default=None)


def motion_checks(
    layer: IsolationLayer,
    limits: Mapping[str, Limits | Lacking],
    displacement: Measured | Lacking,
    residual: Measured | Lacking,
) -> tuple[Check, ...]:
    """Checks of how far the isolators moved, and of what remained, against limits of the building (m)."""
    return (
        *(_share(name, displacement, length_of(layer, name), limits[name]) for name in LENGTHS if name in limits),
        checked(RESIDUAL_OFFSET, residual, limits[RESIDUAL_OFFSET], unit="m"),
    )


def accumulated_checks(
    limits: Mapping[str, Limits | Lacking], rest_position: Measured | Lacking, travel: Measured | Lacking
) -> tuple[Check, ...]:
    """Checks of what all earthquakes add up to (m); of the travel only where there are dampers."""
    rest = checked(REST_POSITION, rest_position, limits[REST_POSITION], unit="m")
    return (rest, checked(TRAVEL, travel, limits[TRAVEL], unit="m")) if TRAVEL in limits else (rest,)


def _share(name: str, displacement: Measured | Lacking, length: float | None, limits: Limits | Lacking) -> Check:
    """A displacement over a length of the building file."""
    if isinstance(limits, Lacking) or length is None:
        return checked(name, NO_LENGTH, limits)
    if isinstance(displacement, Lacking):
        return checked(name, displacement, limits)
    u = displacement.uncertainty
    share = replace(displacement, value=displacement.value / length, uncertainty=None if u is None else u / length)
    return checked(name, share, limits)


def _given(name: str, levels: GivenLimits) -> Limits:
    source = f"{levels.source}, in the building file"
    numbers = [levels.watch, levels.inspect, levels.act]
    if name == LONG_PERIOD:
        numbers = [None if one is None else CLASSES[round(one) - 1] for one in numbers]
    watch, inspect, act = numbers
    return Limits(watch=watch, inspect=inspect, act=act, source=source)


def _over_length(name: str, limits: Limits, layer: IsolationLayer) -> Limits | Lacking:
    length, key = length_of(layer, name), LENGTHS[name]
    if length is None:
        return Lacking(
            reason=f"The building file gives no {key}.", remedy=f"Give {key} under [isolation] in the building file."
        )
    return replace(limits, source=f"{limits.source}; {key} is {plain(length * MM)} mm in the building file")
