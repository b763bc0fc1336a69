"""Rights that one process holds at a time, such as polling."""

from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, delete
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import InstrumentedAttribute, Session

from service.jobs.tables import Lease

POLLING = "polling"
"""The poller's."""
POLLING_LEASE = timedelta(seconds=60)
WORKING = "working"
"""Held by one of the workers as long as any of them is alive."""


def hold(session: Session, name: str, holder: str, now: datetime, duration: timedelta) -> bool:
    """Take or extend a right; False while another process holds it."""
    dialect = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    session.execute(
        dialect.insert(Lease).values(name=name, holder=holder, until=now + duration).on_conflict_do_nothing()
    )
    lease = session.get_one(Lease, name, with_for_update=True)
    if lease.holder != holder and not has_passed(lease.until, now, duration):
        return False
    lease.holder, lease.until = holder, now + duration
    return True


def give_up(session: Session, name: str, holder: str) -> None:
    """Let another process have it at once."""
    session.execute(delete(Lease).where(Lease.name == name, Lease.holder == holder))


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
