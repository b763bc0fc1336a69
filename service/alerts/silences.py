"""Is an alert silenced?"""

from collections.abc import Sequence
from datetime import datetime
from fnmatch import fnmatchcase

from service.alerts.tables import Alert, Silence


def silence_of(alert: Alert, silences: Sequence[Silence], now: datetime) -> Silence | None:
    """The silence that holds for an alert, the one that lasts longest; None where messages are sent."""
    held = (one for one in silences if one.starts_at <= now < one.ends_at and _is_named(alert, one.pattern))
    return max(held, key=lambda one: one.ends_at, default=None)


def _is_named(alert: Alert, pattern: str) -> bool:
    """Whether a pattern is that of an alert's cause, or of each of its parts that are active (`stiffness/x`)."""
    parts = [part["subject"] for part in alert.evidence.get("parts", ()) if part["state"] == "active"]
    every = bool(parts) and all(fnmatchcase(f"{alert.cause}/{one}", pattern) for one in parts)
    return every or fnmatchcase(alert.cause, pattern)
