"""Whether the service is alive and ready."""

from datetime import UTC, datetime

from fastapi import APIRouter, Request, Response
from sqlalchemy.exc import SQLAlchemyError

from service import migrate, queries, schemas
from service.errors import documented, problem
from service.parameters import Reading
from service.poller import POLLING

router = APIRouter(tags=["operations"])


@router.get("/healthz", operation_id="is_alive", response_model=schemas.Health)
async def alive() -> schemas.Health:
    """200 while the process answers; open to all, and it tells nothing else."""
    return schemas.Health(status="alive")


@router.get("/readyz", operation_id="is_ready", response_model=schemas.Health, responses=documented(503))
def ready(request: Request, sessions: Reading) -> schemas.Health | Response:
    """200 if the database answers, has its tables, and a poller was seen lately; else 503 with what is missing."""
    try:
        standing = migrate.revision(request.app.state.settings.database_url)
        if standing is None:
            return problem(503, "The database has no tables yet; 'menshin up' or 'menshin api' makes them.")
        with sessions() as session:
            until = queries.lease_until(session, POLLING)
    except SQLAlchemyError:
        return problem(503, "The database does not answer.")
    if until is None or until < datetime.now(UTC):
        return problem(503, "No poller was seen lately; 'menshin poll' or 'menshin up' starts one.")
    return schemas.Health(status="ready")
