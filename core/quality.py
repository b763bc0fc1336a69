"""What screening has to say about a record, and how bad it is."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["note", "warning", "fatal"]
"""`note`: mended or harmless; `warning`: the results may be affected; `fatal`: its direction is left out; an
event with no direction left is refused."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that screening found."""

    kind: str
    """What was found, one word that programs may rely on: `gap`, `spike`, `clipping`, `dead`, `swapped`, ..."""
    severity: Severity
    message: str
    """For an engineer: what was found, with its number and unit, and what would do."""
    channel: str | None = None
    value: float | None = None
    """The finding's number, in SI units, where it has one."""
