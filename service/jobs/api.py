"""Jobs in the API."""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request
from fastapi.sse import EventSourceResponse
from sqlalchemy.orm import Session, sessionmaker

from service.access.auth import Caller, engineer
from service.http.paging import Before, Limit, page_by_number
from service.http.parameters import LARGEST, JobId, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses
from service.http.server_sent_events import followed
from service.jobs import requests
from service.jobs.queue import UNDER_WAY
from service.jobs.schema import JobOut, Jobs
from service.language.choice import ENGLISH, Language
from service.language.translation import said

router = APIRouter(tags=["operations"], route_class=TaggedRoute)

State = Annotated[
    Literal["waiting", "running", "done", "failed", "cancelled"] | None, Query(description="Only jobs in this state.")
]
By = Annotated[Caller, Depends(engineer)]
OfModel = Annotated[int | None, Query(description="Only jobs on this model.", ge=1, le=LARGEST)]
In = Annotated[Language, Query(description="Language of the current stage in words.")]
OfEvent = Annotated[int | None, Query(description="Only jobs of this event.", ge=1, le=LARGEST)]


@router.get("/jobs", operation_id="list_jobs", **responses(Jobs))
def jobs(
    sessions: Reading,
    state: State = None,
    event: OfEvent = None,
    model: OfModel = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Jobs:
    """Jobs, the latest first."""
    with sessions() as session:
        items = [JobOut.model_validate(job) for job in requests.jobs(session, state, event, model, cursor, limit)]
    return page_by_number(Jobs, items, limit)


@router.get("/jobs/{job_id}", operation_id="get_job", **responses(JobOut, 404))
def job(job_id: JobId, sessions: Reading) -> JobOut:
    """A job and its progress."""
    with sessions() as session:
        return JobOut.model_validate(requests.job(session, job_id))


@router.delete(
    "/jobs/{job_id}",
    operation_id="cancel_job",
    response_model=JobOut,
    responses=openapi_responses(401, 403, 404, 409, 422),
)
def cancel(job_id: JobId, sessions: Writing, by: By) -> JobOut:
    """Cancel a job that waits or runs. Engineers cancel their own, admins those of others; else 409 or 403.

    What Menshin queued by itself, such as the first analysis of an earthquake, cannot be cancelled.
    """
    with sessions.begin() as session:
        return JobOut.model_validate(requests.cancel_for(session, job_id, by, datetime.now(UTC)))


def existing(job_id: JobId, sessions: Reading) -> int:
    """The number of a job that exists; checked before a stream begins, which can only succeed."""
    with sessions() as session:
        return requests.job(session, job_id).id


@router.get(
    "/jobs/{job_id}/progress",
    operation_id="follow_job",
    response_class=EventSourceResponse,
    responses=openapi_responses(401, 403, 404, 422),
)
async def progress(
    request: Request, identity: Annotated[int, Depends(existing)], sessions: Reading, language: In = ENGLISH
) -> AsyncIterator[JobOut]:
    """The job as server-sent events: as it is, then whenever it changes, until it has ended.

    A stream without news for long ends as well, and so does one whose key was revoked; browsers ask again.
    """
    async for state in followed(request, partial(_answered, sessions, identity, language), _has_ended):
        yield state


def _has_ended(job: JobOut) -> bool:
    return job.state not in UNDER_WAY


def _answered(sessions: sessionmaker[Session], identity: int, language: Language) -> JobOut:
    with sessions() as session:
        found = JobOut.model_validate(requests.job(session, identity))
    if found.progress is not None:
        found.progress.doing = said(found.progress.doing, language)
    return found
