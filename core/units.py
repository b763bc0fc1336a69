"""SI values in the units that engineers read: kN, mm, kN/mm."""

from collections.abc import Mapping
from types import MappingProxyType

from core.rounding import with_std

SHOWN: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "m": ("mm", 1e3),
        "m/s": ("mm/s", 1e3),
        "N": ("kN", 1e-3),
        "N/m": ("kN/mm", 1e-6),
        "N/m^2": ("kN/mm²", 1e-9),
        "N/m^3": ("kN/mm³", 1e-12),
        "N/m^5": ("kN/mm⁵", 1e-18),
        "N s/m": ("kN s/mm", 1e-6),
        "N s/m^3": ("kN s/mm³", 1e-12),
        "kg": ("t", 1e-3),
        "1": ("", 1.0),
    }
)
"""Name of the unit that engineers read, and its number per SI unit; units that are not listed are shown as they are."""


def unit(si: str | None) -> str:
    """Name of the unit that engineers read."""
    return SHOWN.get(si or "1", (si or "", 1.0))[0]


def shown(value: float, si: str | None) -> float:
    """A value in the unit that engineers read."""
    return value * SHOWN.get(si or "1", ("", 1.0))[1]


def quantity(value: float, si: str, std: float | None = None) -> str:
    """An SI value in the unit that engineers read, to the digit that its standard deviation supports: `8,630 ± 120 kN`.

    Args:
        value: in SI units.
        si: its unit.
        std: its standard deviation, in SI units; None or 0 if unknown.
    """
    return with_std(shown(value, si), None if std is None else shown(std, si), unit(si))


def percent(share: float) -> str:
    """A share in percent, to a tenth below 100 %."""
    return f"{100 * share:.1f} %" if share < 1 else f"{100 * share:.0f} %"


def percent_in_table(share: float) -> str:
    """The same, but for a share that rounds to nothing: it may be a little, which is below a tenth."""
    written = percent(share)
    return "< 0.1 %" if written in (percent(0.0), percent(-0.0)) else written
