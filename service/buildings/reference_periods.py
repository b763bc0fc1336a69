"""Reference periods, in which a building counts as healthy."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from core.drift.monitor import Reference
from core.drift.quantities import BOTH_DIRECTIONS, QUANTITIES
from service.buildings.tables import Building
from service.drift.tables import ReferencePeriod
from service.errors import ConflictError
from service.jobs import queue as job_queue


def begin(
    session: Session,
    building: Building,
    quantity: str | None,
    subject: str | None,
    start: datetime | None,
    end: datetime | None,
    reason: str,
    by: str,
    now: datetime,
) -> ReferencePeriod:
    """Set a reference period and monitor the building anew; the earlier ones are kept.

    Args:
        session: of the transaction.
        building: whose it is.
        quantity: one of core.drift.quantities.QUANTITIES; None: all.
        subject: direction, mode or channel; None: all of the quantity.
        start: aware; None: from the first event on.
        end: aware; None: the first events from the start on, until the curve is determined.
        reason: why, for those who come later.
        by: name of the key that requests it.
        now: aware time.

    Raises:
        ConflictError: nothing of that name is watched, it has no reference of its own, or the period ends before it
            starts.
    """
    if quantity is not None and quantity not in QUANTITIES:
        raise ConflictError(f"No quantity {quantity!r} is monitored; there are {', '.join(QUANTITIES)}.")
    if subject is not None and quantity is None:
        raise ConflictError(f"A period for {subject} alone needs a quantity; one for everything needs no subject.")
    if subject == BOTH_DIRECTIONS:
        raise ConflictError(
            f"{BOTH_DIRECTIONS} has no reference of its own; without a subject the period applies to both directions."
        )
    if start is not None and end is not None and end <= start:
        raise ConflictError(f"The period ends at {end:%Y-%m-%dT%H:%MZ}, before it starts; choose a later end.")
    made = ReferencePeriod(
        building_id=building.id,
        quantity=quantity,
        subject=subject,
        start=start,
        end=end,
        author=by,
        reason=reason,
        created_at=now,
    )
    session.add(made)
    session.flush()
    job_queue.enqueue_monitoring(session, building.id, by, now)
    return made


def in_force(periods: Sequence[ReferencePeriod], quantity: str, subject: str) -> ReferencePeriod | None:
    """The latest period that applies to a series; None: the first events are the reference.

    Args:
        periods: of a building, in the order in which they were set.
        quantity: one of core.drift.quantities.QUANTITIES.
        subject: direction, mode or channel.
    """
    holding = (one for one in reversed(periods) if one.quantity in (None, quantity) and one.subject in (None, subject))
    return next(holding, None)


def reference(period: ReferencePeriod | None) -> Reference:
    """The period as core takes it."""
    return Reference() if period is None else Reference(period.start, period.end)
