"""The audit trail in the API."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from pydantic import Field

from service.access import auditing
from service.access.auth import engineer
from service.http.paging import Before, Limit, page_by_number
from service.http.parameters import Reading, Time
from service.http.responses import TaggedRoute, table_responses
from service.schema import Answer, Page


class AuditRow(Answer):
    """A change that a person made."""

    id: int = Field(description="Its number.")
    at: datetime = Field(description="Time of the change.")
    by: str = Field(description="Name of the key, or of the account that ran the command.")
    address: str = Field(description="Address of the client, or name of the machine.")
    action: str = Field(description="Method of the request, or the command.")
    target: str = Field(description="Path of the request; empty for a command.")
    details: dict[str, Any] = Field(description="Parameters of the request, without secrets.")


class Audit(Page[AuditRow]):
    """A page of the audit trail, the latest first."""


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
