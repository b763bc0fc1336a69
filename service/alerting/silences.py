"""Is an alert silenced?"""

from collections.abc import Sequence
from datetime import datetime
from fnmatch import fnmatchcase

from service.database import Silence


def silence_of(cause: str, silences: Sequence[Silence], now: datetime) -> Silence | None:
    """The silence that holds for a cause, the one that lasts longest; None where people are told."""
    held = (one for one in silences if one.starts_at <= now < one.ends_at and fnmatchcase(cause, one.pattern))
    return max(held, key=lambda one: one.ends_at, default=None)
