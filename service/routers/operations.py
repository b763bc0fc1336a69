"""How the service is doing: its sources and its jobs."""

from collections.abc import AsyncIterator
from typing import Annotated, Literal

import anyio
from anyio import to_thread
from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.sse import EventSourceResponse
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import described
from service.errors import documented
from service.queries import watched, work
from service.schemas.buildings import SourceOut, Sources
from service.schemas.operations import JobOut, Jobs
from service.web.answers import Format, document, responses, table
from service.web.parameters import LARGEST, Before, JobId, Limit, Reading

router = APIRouter(tags=["operations"])

LOOK = 0.3
"""s between two looks at a job that somebody follows."""

State = Annotated[Literal["waiting", "running", "done", "failed"] | None, Query(description="Only jobs in this state.")]
OfModel = Annotated[int | None, Query(description="Only jobs on this model.", ge=1, le=LARGEST)]
OfEvent = Annotated[int | None, Query(description="Only jobs of this event.", ge=1, le=LARGEST)]


def without_password(location: str) -> str:
    """An address as it may be shown; a path stays as it is."""
    try:
        return make_url(location).render_as_string(hide_password=True) if "@" in location else location
    except ArgumentError:
        return location


@router.get("/sources", operation_id="list_sources", **responses(Sources, csv=True))
def sources(request: Request, sessions: Reading, format: Format = None) -> Response:
    """Every building's monitoring server and how it is doing."""
    with sessions() as session:
        rows = [
            (
                building.code,
                source.kind,
                without_password(source.location),
                *(getattr(state, name, None) for name in ("attempted_at", "succeeded_at", "failing_since", "error")),
            )
            for building, _, state in watched.sources(session)
            if (source := described(session, building).source) is not None
        ]
    return table(request, format, tuple(SourceOut.model_fields), rows, None)


@router.get("/jobs", operation_id="list_jobs", **responses(Jobs))
def jobs(
    request: Request,
    sessions: Reading,
    state: State = None,
    event: OfEvent = None,
    model: OfModel = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Response:
    """Jobs, the latest first."""
    with sessions() as session:
        found = [JobOut.model_validate(job) for job in work.jobs(session, state, event, model, cursor, limit)]
    last = str(found[-1].id) if len(found) == limit and found[-1].id > 1 else None
    return document(request, Jobs(items=found, next=last))


@router.get("/jobs/{job_id}", operation_id="get_job", **responses(JobOut, 404))
def job(request: Request, job_id: JobId, sessions: Reading) -> Response:
    """A job and how far it is."""
    with sessions() as session:
        answer = JobOut.model_validate(work.job(session, job_id))
    return document(request, answer)


def existing(job_id: JobId, sessions: Reading) -> int:
    """The number of a job that there is; asked before a stream begins, which can only succeed."""
    with sessions() as session:
        return work.job(session, job_id).id


@router.get(
    "/jobs/{job_id}/progress",
    operation_id="follow_job",
    response_class=EventSourceResponse,
    responses=documented(401, 403, 404, 422),
)
async def progress(
    request: Request, identity: Annotated[int, Depends(existing)], sessions: Reading
) -> AsyncIterator[JobOut]:
    """The job as server-sent events: as it is, then whenever it changes, until it is done or has failed.

    A stream without news for long ends as well; browsers ask again by themselves.
    """
    patience, seen = request.app.state.settings.progress_patience, None
    told = anyio.current_time()
    while anyio.current_time() - told < patience:
        found = await to_thread.run_sync(_answered, sessions, identity)
        if found != seen:
            seen, told = found, anyio.current_time()
            yield found
        if found.state in ("done", "failed"):
            return
        await anyio.sleep(LOOK)


def _answered(sessions: sessionmaker[Session], identity: int) -> JobOut:
    with sessions() as session:
        return JobOut.model_validate(work.job(session, identity))
