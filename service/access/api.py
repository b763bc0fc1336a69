"""The audit trail in the API."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from service.access import auditing
from service.access.auth import engineer
from service.access.schema import Audit, AuditRow
from service.http.paging import Before, Limit, page_by_number
from service.http.parameters import Reading, Time
from service.http.responses import TaggedRoute, table_responses

router = APIRouter(tags=["operations"], dependencies=[Depends(engineer)], route_class=TaggedRoute)


@router.get("/audit", operation_id="list_audit", **table_responses(Audit))
def entries(
    sessions: Reading,
    by: Annotated[str | None, Query(description="Only changes by this key or account.", max_length=100)] = None,
    after: Annotated[Time | None, Query(description="Only changes at this time or later.")] = None,
    before: Annotated[Time | None, Query(description="Only changes before this time.")] = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Audit:
    """Changes that people made by the API, a page or a command, the latest first; needs an engineer's key."""
    with sessions() as session:
        rows = auditing.entries(session, by, after, before, cursor, limit)
        items = [AuditRow.model_validate(row) for row in rows]
    return page_by_number(Audit, items, limit)
