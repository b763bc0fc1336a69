"""In which unit does a page show a parameter?"""

from collections.abc import Mapping
from types import MappingProxyType

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
"""Name and size of an SI unit's counterpart that engineers read; others are shown as they are."""


def unit(si: str | None) -> str:
    """The unit that a page shows."""
    return SHOWN.get(si or "1", (si or "", 1.0))[0]


def shown(value: float, si: str | None) -> float:
    """A value in the unit that a page shows."""
    return value * SHOWN.get(si or "1", ("", 1.0))[1]
