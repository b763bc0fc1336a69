"""Jobs as people see and cancel them."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.access.roles import Caller, Role
from service.analyses.tables import Analysis
from service.db.select import latest
from service.errors import ConflictError, ForbiddenError, NotFoundError
from service.jobs.queue import ANALYSE, UNDER_WAY, WATCH, last_line
from service.jobs.tables import Job
from service.records.tables import Event


def jobs(
    session: Session, state: str | None, event_id: int | None, model_id: int | None, before: int | None, limit: int
) -> Sequence[Job]:
    """Jobs, the latest first; `before` is the last id of the previous page."""
    query = select(Job)
    for column, wanted in ((Job.state, state), (Job.event_id, event_id), (Job.model_id, model_id)):
        if wanted is not None:
            query = query.where(column == wanted)
    return session.scalars(latest(query, Job.id, before, limit)).all()


def job(session: Session, identity: int) -> Job:
    """A job.

    Raises:
        NotFoundError: no job has that number.
    """
    row = session.get(Job, identity)
    if row is None:
        raise NotFoundError("job", identity, "retention.jobs")
    return row


def cancel_for(session: Session, job_id: int, by: Caller, now: datetime) -> Job:
    """Cancel a job for a person.

    Raises:
        NotFoundError: there is no such job.
        ForbiddenError: another key requested it, and the caller is no admin.
        ConflictError: it has ended, or Menshin queued it itself.
    """
    requested = job(session, job_id)
    of_building = requested.building or next(one.building for one in (requested.event, requested.model) if one)
    by = by.on(of_building.code)
    if requested.asked_by is not None and not may_cancel(requested, by):
        raise ForbiddenError(f"Job {job_id} was requested by {requested.asked_by!r}; only they or an admin cancel it.")
    cancel(session, requested, now)
    return requested


def may_cancel(job: Job, by: Caller) -> bool:
    """True if the caller may cancel the job while it is in progress."""
    return job.asked_by is not None and by.role >= Role.engineer and (job.asked_by == by.name or by.role >= Role.admin)


def cancel(session: Session, job: Job, now: datetime) -> None:
    """Cancel a job that a person requested; the worker that computes it stops within seconds.

    The event of a cancelled analysis goes back to the outcome of its current one.

    Raises:
        ConflictError: the job has ended, or Menshin queued it itself.
    """
    session.refresh(job, with_for_update=True)
    if job.asked_by is None or job.kind == WATCH:
        raise ConflictError(f"Menshin itself needs job {job.id}; only a job that a person requested can be cancelled.")
    if job.state not in UNDER_WAY:
        raise ConflictError(f"Job {job.id} has ended already: {job.state}.")
    job.state, job.claimed_until, job.finished_at = "cancelled", None, now
    session.flush()
    if job.event is not None:
        _restore(session, job.event, now)


def _restore(session: Session, event: Event, now: datetime) -> None:
    """Restore the event's outcome before a cancelled job, unless another job is pending."""
    session.refresh(event, with_for_update={"key_share": True})  # no job is queued for it meanwhile
    own = (Job.event_id == event.id, Job.kind == ANALYSE)
    if session.scalar(select(func.count()).where(*own, Job.state.in_(UNDER_WAY))):
        return
    analysis = session.scalar(select(Analysis).where(Analysis.event_id == event.id, Analysis.current))
    failed = session.scalar(select(Job.error).where(*own, Job.state == "failed").order_by(Job.id.desc()).limit(1))
    if analysis is not None:
        event.state, event.reason = ("analysed", None) if analysis.refusal is None else ("refused", analysis.refusal)
    elif failed is not None:
        event.state, event.reason = "failed", last_line(failed)
    event.updated_at = now
