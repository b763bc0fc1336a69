"""The page where admins of all buildings make, limit and revoke keys; no JavaScript."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from service.access import keys
from service.access.auth import Role, administrator
from service.access.pages import page_for
from service.access.schema import KeyForm, KeyLimitForm, end_of
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.parameters import KeyId, Reading, Writing
from service.http.rendering import SECRETIVE, page

router = APIRouter(include_in_schema=False)

Making = Annotated[Posted[KeyForm], Depends(posted(KeyForm))]
Limiting = Annotated[Posted[KeyLimitForm], Depends(posted(KeyLimitForm))]
ADMINS = [Depends(administrator)]


@router.get("/keys", dependencies=[Depends(page_for(administrator))])
def every(request: Request, sessions: Reading) -> Response:
    """All keys, and the form to make one."""
    return _listed(request, sessions)


def _listed(request: Request, sessions: sessionmaker[Session], refused: Refused = NOT_REFUSED) -> Response:
    """All keys, with a form that was refused."""
    now = datetime.now(UTC)
    with sessions() as session:
        rows = [(one, keys.end_in_words(one, now), keys.is_over(one, now)) for one in keys.every(session)]
        roles = [role.name for role in Role]
        return page(
            request, "keys", refused.status, refused=refused, rows=rows, roles=roles, in_words=keys.roles_in_words
        )


@router.post("/keys", dependencies=ADMINS)
def make(request: Request, sessions: Writing, form: Making) -> Response:
    """Make a key, and show it this once."""

    def act(wanted: KeyForm) -> Response:
        now = datetime.now(UTC)
        with sessions.begin() as session:
            key = keys.create(session, now=now, expires_at=end_of(wanted.days, now), **wanted.granted())
        request.app.state.callers.forget()
        answer = page(request, "key_made", 201, of=wanted.name, key=key)
        answer.headers.update(SECRETIVE)
        return answer

    return answered("key", form, act, lambda refused: _listed(request, sessions, refused))


@router.post("/keys/{key_id}/limit", dependencies=ADMINS)
def limit(request: Request, key_id: KeyId, sessions: Writing, form: Limiting) -> Response:
    """Limit a key, and show all of them."""

    def act(wanted: KeyLimitForm) -> Response:
        now = datetime.now(UTC)
        with sessions.begin() as session:
            keys.limit(session, keys.key(session, key_id), now, wanted.buildings, end_of(wanted.days, now))
        request.app.state.callers.forget()
        return RedirectResponse("/keys", 303)

    return answered(f"limit-{key_id}", form, act, lambda refused: _listed(request, sessions, refused))


@router.post("/keys/{key_id}/revoke", dependencies=ADMINS)
def revoke(request: Request, key_id: KeyId, sessions: Writing) -> Response:
    """Revoke a key, and show all of them."""
    with sessions.begin() as session:
        keys.end(session, keys.key(session, key_id), datetime.now(UTC))
    request.app.state.callers.forget()
    return RedirectResponse("/keys", 303)
