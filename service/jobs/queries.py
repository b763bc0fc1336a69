"""Queries of jobs."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.db.select import latest
from service.errors import NotFoundError
from service.jobs.tables import Job


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
    found = session.get(Job, identity)
    if found is None:
        raise NotFoundError("job", identity)
    return found
