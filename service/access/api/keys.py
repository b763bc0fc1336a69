"""Keys in the API; for admins of all buildings."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response

from service.access import keys
from service.access.auth import administrator
from service.access.schema import KeyLimit, KeyMade, KeyOut, KeyRequest, Keys, end_of, key_out
from service.http.parameters import KeyId, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses

router = APIRouter(tags=["operations"], route_class=TaggedRoute, dependencies=[Depends(administrator)])
REFUSED = openapi_responses(400, 401, 403, 404, 409, 422)


@router.get("/keys", operation_id="list_keys", **responses(Keys))
def every(sessions: Reading) -> Keys:
    """All keys, revoked ones too, without their secrets; needs the key of an admin of all buildings."""
    with sessions() as session:
        return Keys(items=[key_out(one) for one in keys.every(session)])


@router.post(
    "/keys",
    operation_id="make_key",
    status_code=201,
    response_model=KeyMade,
    responses=openapi_responses(400, 401, 403, 409, 422),
)
def make(
    request: Request,
    sessions: Writing,
    response: Response,
    wanted: Annotated[KeyRequest, Body(description="Name, roles and limits.")],
) -> KeyMade:
    """Make a key, which is returned this once; needs the key of an admin of all buildings."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        key = keys.create(session, now=now, expires_at=end_of(wanted.days, now), **wanted.granted())
        answer = KeyMade(**key_out(keys.named(session, wanted.name)).model_dump(), key=key)
    request.app.state.callers.forget()
    response.headers["Cache-Control"] = "no-store"
    return answer


@router.patch("/keys/{key_id}", operation_id="limit_key", response_model=KeyOut, responses=REFUSED)
def limit(
    request: Request,
    key_id: KeyId,
    sessions: Writing,
    wanted: Annotated[KeyLimit, Body(description="Fewer buildings, an earlier end.")],
) -> KeyOut:
    """Limit a key to some of its buildings, or give it an earlier end; needs the key of an admin of all buildings.

    A key never gets more than it had: whoever needs more makes a new one.
    """
    now = datetime.now(UTC)
    with sessions.begin() as session:
        row = keys.key(session, key_id)
        keys.limit(session, row, now, wanted.buildings, end_of(wanted.days, now))
        answer = key_out(row)
    request.app.state.callers.forget()
    return answer


@router.delete("/keys/{key_id}", operation_id="revoke_key", response_model=KeyOut, responses=REFUSED)
def revoke(request: Request, key_id: KeyId, sessions: Writing) -> KeyOut:
    """Revoke a key and end its browser sessions; needs the key of an admin of all buildings."""
    with sessions.begin() as session:
        row = keys.key(session, key_id)
        keys.end(session, row, datetime.now(UTC))
        answer = key_out(row)
    request.app.state.callers.forget()
    return answer
