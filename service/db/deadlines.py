"""Ends of waiting that one process writes down and others read, on clocks that differ and may be set meanwhile.

An end is written as now + its length. One that lies further ahead than that was written before the clock was set back,
or by a process whose clock was ahead; to wait for it would stop the service for as long as the clock was wrong.
"""

from datetime import datetime, timedelta

from sqlalchemy import ColumnElement
from sqlalchemy.orm import InstrumentedAttribute

AHEAD = 2
"""Lengths from now after which no end can lie: one of its own, and one by which two machines' clocks may differ."""


def has_passed(end: datetime, now: datetime, length: timedelta) -> bool:
    """Whether a wait of this length is over."""
    return not now < end <= now + AHEAD * length


def is_wrong(
    end: InstrumentedAttribute[datetime] | InstrumentedAttribute[datetime | None], now: datetime, length: timedelta
) -> ColumnElement[bool]:
    """Whether the end in a column lies further ahead than it can, as a condition: then it has passed as well."""
    return end > now + AHEAD * length
