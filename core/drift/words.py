"""How is a change told to an engineer?"""

from datetime import datetime

from core import rounding
from core.drift.quantities import Quantity
from core.drift.rules import RECOVERY, SLOW, Rule


def message(known: Quantity, rule: Rule, after: datetime, by: datetime, drift: float, low: float, high: float) -> str:
    """One sentence with the change, its interval and between which events it began."""
    pace = {SLOW: "little by little, beginning", RECOVERY: "back, beginning"}.get(rule.name, "beginning")
    began = f"between the events of {after:%Y-%m-%d %H:%M} and {by:%Y-%m-%d %H:%M} UTC"
    return f"the {known.title} has changed by {interval(known, drift, low, high)}, {pace} {began}"


def message_within(known: Quantity, when: datetime, drift: float, low: float, high: float) -> str:
    """One sentence of a change within an event."""
    change = interval(known, drift, low, high)
    return (
        f"within the event of {when:%Y-%m-%d %H:%M} UTC the {known.title} changed by {change}: its cycles after the "
        "largest against those before it, at matched amplitude"
    )


def interval(known: Quantity, drift: float, low: float, high: float) -> str:
    """As in "−8.1 % (95 %: −9.9 to −6.2 %)"."""
    scale, unit = (100.0, "%") if known.is_logarithmic else (1000.0, "mm")
    return rounding.interval(scale * drift, scale * low, scale * high, unit)
