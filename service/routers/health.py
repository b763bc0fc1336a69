"""Whether the service is alive and ready, and what Prometheus may know of it."""

from datetime import UTC, datetime
from typing import Any

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from sqlalchemy.exc import SQLAlchemyError

from service import migrate
from service.access import auth
from service.errors import documented, problem
from service.queries import work
from service.queue.leases import POLLING
from service.schemas.operations import Health
from service.web.parameters import Reading

router = APIRouter(tags=["operations"])
OPEN: dict[str, Any] = {"security": []}
"""In the OpenAPI document: whoever looks after the service asks without a key."""

OTHER_TABLES = (
    "The tables of the database are not those of this version; 'menshin up', 'menshin api', 'menshin poll' or "
    "'menshin work' of the newest version makes them so."
)
METRICS = "The metrics in Prometheus' text format, each with its meaning."


@router.get("/healthz", operation_id="is_alive", response_model=Health, openapi_extra=OPEN)
async def alive() -> Health:
    """200 while the process answers; open to all, and it tells nothing else."""
    return Health(status="alive")


@router.get(
    "/readyz",
    operation_id="is_ready",
    response_model=Health,
    responses=documented(503),
    openapi_extra=OPEN,
)
def ready(sessions: Reading) -> Health | Response:
    """200 if the database answers, has this version's tables, and a poller was seen lately; else 503 with the lack."""
    try:
        with sessions() as session:
            if not migrate.is_newest(session):
                return problem(503, OTHER_TABLES)
            until = work.lease_until(session, POLLING)
    except SQLAlchemyError:
        return problem(503, "The database does not answer.")
    if until is None or until < datetime.now(UTC):
        return problem(503, "No poller was seen lately; 'menshin poll' or 'menshin up' starts one.")
    return Health(status="ready")


@router.get(
    "/metrics",
    operation_id="get_metrics",
    dependencies=[Depends(auth.viewer)],
    response_class=Response,
    responses=documented(401, 403) | {200: {"description": METRICS, "content": {CONTENT_TYPE_LATEST: {}}}},
)
def measured(request: Request) -> Response:
    """State of buildings, events and jobs, and the durations of requests, for Prometheus; it takes a viewer's key.

    Times are Unix times: `time() - menshin_oldest_waiting_job_timestamp_seconds` is how long a job has waited.
    """
    return Response(generate_latest(request.app.state.metrics), media_type=CONTENT_TYPE_LATEST)
