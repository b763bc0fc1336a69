"""How the service is doing: its sources and its jobs."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

from service.answers import Format, document, responses, table
from service.buildings import described
from service.parameters import LARGEST, Before, JobId, Limit, Reading
from service.queries import watched, work
from service.schemas.buildings import SourceOut, Sources
from service.schemas.operations import JobOut, Jobs

router = APIRouter(tags=["operations"])

State = Annotated[Literal["waiting", "running", "done", "failed"] | None, Query(description="Only jobs in this state.")]
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
    cursor: Before = None,
    limit: Limit = 50,
) -> Response:
    """Jobs, the latest first."""
    with sessions() as session:
        found = [JobOut.model_validate(job) for job in work.jobs(session, state, event, cursor, limit)]
    last = str(found[-1].id) if len(found) == limit and found[-1].id > 1 else None
    return document(request, Jobs(items=found, next=last))


@router.get("/jobs/{job_id}", operation_id="get_job", **responses(JobOut, 404))
def job(request: Request, job_id: JobId, sessions: Reading) -> Response:
    """A job and how far it is."""
    with sessions() as session:
        answer = JobOut.model_validate(work.job(session, job_id))
    return document(request, answer)
