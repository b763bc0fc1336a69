"""Endpoints on the state of the service: alive, ready, and metrics for Prometheus."""

from datetime import UTC, datetime
from typing import Any

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import Field
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker

from service.access import auth
from service.db import migrate
from service.health import metrics, readiness
from service.http.parameters import Reading
from service.http.problems import openapi_responses, problem
from service.schema import Answer
from service.settings import Settings

router = APIRouter(tags=["operations"])
OPEN: dict[str, Any] = {"security": []}
"""In the OpenAPI document: these endpoints need no key."""

OTHER_TABLES = "the tables of the database are not those of this version"
NEWEST = "'menshin up', 'menshin api', 'menshin poll' or 'menshin work' of the newest version makes them so"
STARTS = "start the database server, or check database_url; the service then continues by itself"
METRICS = "The metrics in Prometheus' text format, each with its meaning."


class Health(Answer):
    """Liveness of the process."""

    status: str = Field(description="`alive`.", examples=["alive"])


class CheckOut(Answer):
    """One condition for the service to work."""

    name: str = Field(description="`database`, `disk`, `clock`, `poller`, `looks` or `worker`.")
    ok: bool = Field(description="True if it is as it has to be.")
    since: datetime | None = Field(description="Time since which it is not, as far as that is known; null while it is.")
    found: str = Field(description="Its state in words.")
    helps: str = Field(description="The remedy; empty where none is needed.")


class Readiness(Answer):
    """Readiness of the service."""

    status: str = Field(description="`ready`.", examples=["ready"])
    checks: list[CheckOut] = Field(description="All that was checked.")


@router.get("/healthz", operation_id="is_alive", response_model=Health, openapi_extra=OPEN)
async def alive() -> Health:
    """200 while the process answers; open to everyone, without further information."""
    return Health(status="alive")


@router.get(
    "/readyz",
    operation_id="is_ready",
    response_model=Readiness,
    responses=openapi_responses(503),
    openapi_extra=OPEN,
)
def ready(request: Request) -> Readiness | Response:
    """200 if polling and analyses really happen and can be stored; otherwise 503, and `checks` lists the problems.

    Checked are the database and its tables, its disk, the clock, a poller, the polls of every source, and a worker.
    """
    state, now = request.app.state, datetime.now(UTC)
    checks = [_check(one, state.unready_since, now) for one in _checks(state.reading, state.settings, now)]
    if all(one.ok for one in checks):
        return Readiness(status="ready", checks=checks)
    detail = "; ".join(one.found for one in checks if not one.ok)
    return problem(503, f"Not ready: {detail}.", checks=[one.model_dump() for one in checks])


def _checks(sessions: sessionmaker[Session], settings: Settings, now: datetime) -> tuple[readiness.Check, ...]:
    try:
        with sessions() as session:
            if not migrate.is_newest(session):
                return (readiness.Check("database", False, OTHER_TABLES, NEWEST),)
            answers = readiness.Check("database", True, "the database answers and has this version's tables")
            return (answers, *readiness.checks(session, settings, now))
    except SQLAlchemyError:
        return (readiness.Check("database", False, "the database does not answer", STARTS),)


def _check(check: readiness.Check, noticed: dict[str, datetime], now: datetime) -> CheckOut:
    """A check with the start of its failure: as stored, otherwise when this process first noticed it."""
    if check.ok:
        noticed.pop(check.name, None)
        return CheckOut(name=check.name, ok=True, since=None, found=check.found, helps=check.helps)
    since = check.since or noticed.setdefault(check.name, now)
    return CheckOut(name=check.name, ok=False, since=since, found=check.found, helps=check.helps)


@router.get(
    "/metrics",
    operation_id="get_metrics",
    dependencies=[Depends(auth.viewer)],
    response_class=Response,
    responses=openapi_responses(401, 403) | {200: {"description": METRICS, "content": {CONTENT_TYPE_LATEST: {}}}},
)
def measured(request: Request, sessions: Reading) -> Response:
    """State of buildings, events and jobs, and the durations of requests, for Prometheus; it takes a viewer's key.

    A key of some buildings gets their state alone.

    Times are Unix times: `time() - menshin_oldest_waiting_job_timestamp_seconds` is how long a job has waited.
    """
    is_limited = auth.caller(request).buildings is not None
    durations = None if is_limited else request.app.state.durations
    return Response(metrics.exposition(sessions, durations), media_type=CONTENT_TYPE_LATEST)
