"""Work that waits in the database: claimed under a lease, finished under a fencing token."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import and_, or_, select, update
from sqlalchemy.orm import Session

from service.database import Event, Job

ANALYSE = "analyse"


@dataclass(frozen=True, slots=True)
class Claim:
    """A worker's right to a job, until its lease lapses or another worker takes over."""

    job_id: int
    event_id: int
    arguments: Mapping[str, Any]
    token: int
    """How often the job had been claimed when this claim was made."""
    failures: int
    """Attempts that went wrong before."""


def enqueue(session: Session, event: Event, arguments: Mapping[str, Any], now: datetime) -> Job:
    """Queue the analysis of an event, in the transaction that stores it; a like job that still waits will do.

    Args:
        session: of the transaction.
        event: a stored event.
        arguments: analysis settings that differ from the service's own, by name.
        now: aware time.
    """
    event.state, event.reason, event.updated_at = "queued", None, now
    waiting = select(Job).where(Job.event_id == event.id, Job.kind == ANALYSE, Job.state == "waiting")
    for job in session.scalars(waiting):
        if job.arguments == dict(arguments):
            return job
    job = Job(
        kind=ANALYSE,
        event_id=event.id,
        arguments=dict(arguments),
        state="waiting",
        claims=0,
        failures=0,
        created_at=now,
    )
    session.add(job)
    session.flush()
    return job


def claim(session: Session, now: datetime, lease: timedelta) -> Claim | None:
    """Take a job that nobody holds, the oldest of those claimed least; None if there is none.

    A job over which workers die again and again so comes last, and holds up no other.
    """
    lapsed = and_(Job.state == "running", Job.claimed_until < now)
    job = session.scalar(
        select(Job)
        .where(or_(Job.state == "waiting", lapsed))
        .order_by(Job.claims, Job.id)
        .limit(1)
        .with_for_update(skip_locked=True, of=Job)
    )
    if job is None:
        return None
    job.state, job.claimed_until, job.claims = "running", now + lease, job.claims + 1
    return Claim(job.id, job.event_id, job.arguments, job.claims, job.failures)


def extend(session: Session, held: Claim, now: datetime, lease: timedelta) -> bool:
    """Hold the job for another lease; False if the claim is no longer valid."""
    return _change(session, held, claimed_until=now + lease)


def finish(session: Session, held: Claim, now: datetime) -> bool:
    """The job is done; False if the claim is no longer valid: then nothing may be written for it."""
    return _change(session, held, state="done", claimed_until=None, error=None, finished_at=now)


def release(session: Session, held: Claim) -> bool:
    """Put the job back at once for any worker; False if the claim is no longer valid."""
    return _change(session, held, state="waiting", claimed_until=None)


def fail(session: Session, held: Claim, error: str, now: datetime, attempts: int) -> bool:
    """An attempt went wrong: the job waits for the next one, or is given up after the last and its event says why.

    Returns:
        False if the claim is no longer valid.
    """
    failures = held.failures + 1
    if failures < attempts:
        return _change(session, held, state="waiting", claimed_until=None, error=error, failures=failures)
    if not _change(session, held, state="failed", claimed_until=None, error=error, failures=failures, finished_at=now):
        return False
    event = session.get_one(Event, held.event_id)
    event.state, event.reason, event.updated_at = "failed", error.strip().splitlines()[-1], now
    return True


def _change(session: Session, held: Claim, **values: object) -> bool:
    valid = (Job.id == held.job_id, Job.state == "running", Job.claims == held.token)
    return session.connection().execute(update(Job).where(*valid).values(**values)).rowcount == 1
