"""What people did."""

from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Depends, Query, Request, Response

from service.access import audit_queries
from service.access.auth import engineer
from service.alerts.schema import Audit, AuditRow
from service.http.parameters import Before, Limit, Reading, Time
from service.http.responses import Format, responses, table, wants_csv

router = APIRouter(tags=["operations"], dependencies=[Depends(engineer)])


@router.get("/audit", operation_id="list_audit", **responses(Audit, csv=True))
def entries(
    request: Request,
    sessions: Reading,
    by: Annotated[str | None, Query(description="Only what this key or account did.", max_length=100)] = None,
    after: Annotated[Time | None, Query(description="Only what was done then or later.")] = None,
    before: Annotated[Time | None, Query(description="Only what was done before that.")] = None,
    cursor: Before = None,
    limit: Limit = 50,
    format: Format = None,
) -> Response:
    """What people changed, by the API, a page or a command, the latest first; it takes an engineer's key."""
    with sessions() as session:
        found = audit_queries.entries(session, by, after, before, cursor, limit)
    columns = tuple(AuditRow.model_fields)
    as_text = wants_csv(request, format)
    rows = [
        (one.id, one.at, one.by, one.address, one.action, one.target, _text(one.details) if as_text else one.details)
        for one in found
    ]
    last = str(found[-1].id) if len(found) == limit and found[-1].id > 1 else None
    return table(request, format, columns, rows, last)


def _text(details: dict[str, Any]) -> str:
    """One field of CSV."""
    return orjson.dumps(details).decode()
