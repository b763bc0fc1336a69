"""Data quality findings and their severity."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["note", "warning", "fatal"]
"""`note`: mended or harmless; `warning`: the results may be affected; `fatal`: its direction is left out. An event
without any direction is rejected."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One data quality finding."""

    kind: str
    """Kind of the finding, one word that programs may rely on: `gap`, `spike`, `clipping`, `dead`, `swapped`, ..."""
    severity: Severity
    message: str
    """For an engineer: the problem, with its number and unit, and what helps."""
    channel: str | None = None
    value: float | None = None
    """The finding's number in SI units, if it has one."""
