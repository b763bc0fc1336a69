"""How are a cause, a time and a length told to people?"""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta

from core.drift.pooled import BOTH_DIRECTIONS
from core.drift.quantities import QUANTITIES

MM = 1e3
LIMITS = "limits"
"""Cause of the alert that a limit of the isolators was exceeded."""
TITLES: Mapping[str, str] = {
    LIMITS: "limits of the isolators",
    "stiffness": "stiffness of the isolators",
    "damping": "damping of the isolators",
    "frequency": "natural frequency of the building",
    "residual_displacement": "place at which the isolators rest",
    "gain": "sensitivity of sensor",
    "noise": "noise of sensor",
    "model_error": "model of the isolators",
    "source": "monitoring server",
    "record": "records",
    "rejected": "files that could not be used",
    "channel": "sensor",
    "clock": "clock",
    "worker": "analyses that wait",
    "disk": "disk space",
}
"""Of the first part of a cause."""
SENSOR_QUANTITIES = frozenset({"gain", "noise"})
"""Those whose subject is a channel; that of all others begins with a direction."""
RECOVERED = "recovery"
"""First part of a cause that is about the return of the one that follows."""


def quantity_of(cause: str) -> str | None:
    """The watched quantity that a cause is about; None of what goes by the clock."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return quantity_of(rest)
    return first if first in QUANTITIES else None


def sensor_of(cause: str) -> str | None:
    """Channel of the sensor that a cause is about; None of what is about the building, or goes by the clock."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return sensor_of(rest)
    return rest if first in SENSOR_QUANTITIES else None


def of_cause(cause: str) -> str:
    """`stiffness of the isolators, direction x`; a cause that has no words yet stands for itself."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return f"return of the {of_cause(rest)}"
    title = TITLES.get(first)
    if title is None:
        return cause
    if not rest:
        return title
    if title.endswith("sensor"):
        return f"{title} {rest}"
    return f"{title}, {of_subject(rest)}"


def of_subject(subject: str) -> str:
    """`direction x`, `both directions on average`, `direction x, mode 1`."""
    direction, _, mode = subject.partition("/")
    where = "both directions on average" if direction == BOTH_DIRECTIONS else f"direction {direction}"
    return where + (f", mode {mode}" if mode else "")


def of_time(local: datetime) -> str:
    """`5 January 2024, 14:03 (JST)`, of a time in the building's zone."""
    zone = f"{local:%Z}"
    named = f"UTC{zone}" if zone[:1] in "+-" else zone
    return f"{local.day} {local:%B %Y, %H:%M} ({named})"


def of_span(first: datetime, last: datetime) -> str:
    """`5 January 2024, 14:03 and 7 March 2024, 09:10 (JST)`, of two times in the building's zone."""
    whole, end = of_time(first), of_time(last)
    zone = f" {whole.rpartition(' ')[2]}"
    return f"{whole.removesuffix(zone) if end.endswith(zone) else whole} and {end}"


def of_length(metres: float) -> str:
    """In mm: `24 mm`, `2.4 mm`; more than that nobody feels."""
    millimetres = metres * MM
    return f"{millimetres:.0f} mm" if abs(millimetres) >= 9.95 else f"{millimetres:.1f} mm"


def of_duration(span: timedelta) -> str:
    """In the largest unit that gives two or more of it: `3 days`, `90 minutes`, `40 seconds`."""
    seconds = span.total_seconds()
    for unit, size in (("days", 86400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} seconds"


def listed(names: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
