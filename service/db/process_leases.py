"""Leases: rights that one process has at a time, such as polling."""

from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, delete, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import InstrumentedAttribute, Session

from service.jobs.tables import Lease

POLLING = "polling"
"""Lease of the one poller that does the periodic checks and queues events."""
SHARING = "poller/"
"""Beginning of the lease by which each poller says that it is alive, before its name."""
POLLING_LEASE = timedelta(seconds=60)
"""Time after which the lease of a silent poller expires. Not tuned."""
WORKING = "working"
"""Lease of one of the workers while any worker is alive."""
NOTIFYING = "notifying"
"""Lease of the one notifier that does the housekeeping."""


def hold(
    session: Session, name: str, holder: str, now: datetime, duration: timedelta, trouble: str | None = None
) -> bool:
    """Acquire or extend a lease, and say what keeps the holder from its work; False while another process has it."""
    dialect = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    session.execute(
        dialect.insert(Lease).values(name=name, holder=holder, until=now + duration).on_conflict_do_nothing()
    )
    lease = session.get_one(Lease, name, with_for_update=True)
    if lease.holder != holder and not has_passed(lease.until, now, duration):
        return False
    lease.holder, lease.until, lease.trouble = holder, now + duration, trouble
    return True


def give_up(session: Session, name: str, holder: str) -> None:
    """Release a lease, so that another process can acquire it at once."""
    session.execute(delete(Lease).where(Lease.name == name, Lease.holder == holder))


def sharing(session: Session, now: datetime) -> dict[str, datetime]:
    """End of the lease of every poller that is alive, by its name; expired leases are removed."""
    leases = session.scalars(select(Lease).where(Lease.name.startswith(SHARING, autoescape=True))).all()
    expired = [one for one in leases if has_passed(one.until, now, POLLING_LEASE)]
    for one in expired:
        give_up(session, one.name, one.holder)
    return {one.holder: one.until for one in leases if one not in expired}


AHEAD = 2
"""Lease lengths from now beyond which no end can lie: its own length, and one for the difference of two machines'
clocks."""


def has_passed(end: datetime, now: datetime, length: timedelta) -> bool:
    """True if a wait of this length is over."""
    return not now < end <= now + AHEAD * length


def is_wrong(
    end: InstrumentedAttribute[datetime] | InstrumentedAttribute[datetime | None], now: datetime, length: timedelta
) -> ColumnElement[bool]:
    """SQL condition: the stored end lies further ahead than possible, so that the lease counts as expired."""
    return end > now + AHEAD * length
