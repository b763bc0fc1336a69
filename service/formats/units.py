"""Units by name: their quantity and their factor to SI units.

All units are defined here: everything behind the formats is SI.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

from core.record import Quantity
from service.formats.format_errors import FormatError

STANDARD_GRAVITY = 9.80665  # m/s², CGPM 1901, exact


@dataclass(frozen=True, slots=True)
class Gain:
    """Conversion of a stored number to SI units."""

    si_per_count: float
    """SI units (m/s², m/s, m, °C) per stored number; negative where the sensor is mounted reversed."""
    quantity: Quantity

    def __post_init__(self) -> None:
        if not isfinite(self.si_per_count) or self.si_per_count == 0:
            raise FormatError(f"a gain must be a finite number other than 0, got {self.si_per_count}")


UNITS: Mapping[str, Gain] = {
    "m/s**2": Gain(1.0, "acceleration"),
    "cm/s**2": Gain(1e-2, "acceleration"),
    "mm/s**2": Gain(1e-3, "acceleration"),
    "um/s**2": Gain(1e-6, "acceleration"),
    "nm/s**2": Gain(1e-9, "acceleration"),
    "gal": Gain(1e-2, "acceleration"),
    "mgal": Gain(1e-5, "acceleration"),
    "g": Gain(STANDARD_GRAVITY, "acceleration"),
    "mg": Gain(1e-3 * STANDARD_GRAVITY, "acceleration"),
    "m/s": Gain(1.0, "velocity"),
    "cm/s": Gain(1e-2, "velocity"),
    "mm/s": Gain(1e-3, "velocity"),
    "um/s": Gain(1e-6, "velocity"),
    "nm/s": Gain(1e-9, "velocity"),
    "m": Gain(1.0, "displacement"),
    "cm": Gain(1e-2, "displacement"),
    "mm": Gain(1e-3, "displacement"),
    "um": Gain(1e-6, "displacement"),
    "nm": Gain(1e-9, "displacement"),
    "degc": Gain(1.0, "temperature"),
}
"""SI units per unit, by its name as `canonical` spells it."""

SPELLINGS: Mapping[str, str] = {
    "celsius": "degc",
    "°c": "degc",
    "cel": "degc",
    "degrees celsius": "degc",
    "deg_c": "degc",
}
"""Other names of the units above, in small letters."""


def canonical(unit: str) -> str:
    """The spelling of a unit in UNITS: `M/S^2`, `m/s/s`, `m/sec2` and `m s-2` are all `m/s**2`."""
    name = unit.strip().lower().replace("µ", "u").replace("μ", "u").replace("sec", "s").replace("²", "**2")
    name = name.replace("^2", "**2").replace("/s/s", "/s**2").replace("(m/s)/s", "m/s**2")
    if name.endswith("/s2"):
        name = name.removesuffix("2") + "**2"
    for exponent, quotient in ((" s-2", "/s**2"), ("*s**-2", "/s**2"), (" s**-2", "/s**2"), (" s-1", "/s")):
        name = name.replace(exponent, quotient)
    return SPELLINGS.get(name, name)


def unit_gain(unit: str) -> Gain:
    """The quantity and factor of a unit.

    Raises:
        FormatError: a unit that is missing, or that is none of acceleration, velocity, displacement or temperature.
    """
    known = UNITS.get(canonical(unit))
    if known is None:
        problem = f"unit {unit!r} is not known" if unit.strip() else "the unit is missing"
        raise FormatError(f"{problem}; use one of {', '.join(UNITS)}")
    return known
