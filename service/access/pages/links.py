"""Links to one building: the page where admins make and revoke them, and the door that they open."""

from datetime import UTC, datetime
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from service.access import links
from service.access.auth import LINK, SAFE_LINK, Caller, admin, is_secure
from service.access.pages import MOST, address_of, flags, login_form, must_wait, note_session, page_for
from service.access.roles import digest
from service.access.schema import LinkRequest, link_out
from service.buildings import queries as building_queries
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.parameters import Code, LinkId, Reading, Writing
from service.http.rendering import SECRETIVE, page

router = APIRouter(include_in_schema=False)

By = Annotated[Caller, Depends(admin)]
Visitor = Annotated[Caller, Depends(page_for(admin))]
Making = Annotated[Posted[LinkRequest], Depends(posted(LinkRequest))]
NOT_VALID = "This link has ended, was revoked, or is not complete. Ask whoever sent it for a new one, or log in."


def public_address(request: Request) -> str:
    """Address of the pages: that of the settings, otherwise that of the request."""
    return request.app.state.settings.public_url or str(request.base_url)


@router.get("/link")
async def follow(request: Request, token: Annotated[str, Query(max_length=MOST)] = "") -> Response:
    """Let a browser read the pages of the link's building; its own login, if there is one, goes before."""
    if (waiting := must_wait(request, "/")) is not None:
        return waiting
    request.app.state.callers.forget()  # the link may have been made, or revoked, a moment ago
    known = (await request.app.state.callers.known()).links.get(digest(token))
    if known is None:
        return await to_thread.run_sync(_refused, request)
    (code,) = known.buildings
    # Not a redirect: a browser that comes from a mail or another site would not send the strict cookie with it.
    answer = page(request, "link_opened", code=code, end=known.expires_at)
    answer.headers.update(SECRETIVE)
    secure = is_secure(request)
    lasts = int((known.expires_at - datetime.now(UTC)).total_seconds())
    answer.set_cookie(SAFE_LINK if secure else LINK, token, lasts, **flags(secure=secure))
    return answer


def _refused(request: Request) -> Response:
    request.app.state.attempts.refuse(address_of(request))
    with request.app.state.sessions.begin() as session:
        note_session(session, request, None, reason="a link that is not valid")
    answer = login_form(request, "/", Refused("login", words=NOT_VALID, status=401))
    answer.headers.update(SECRETIVE)
    return answer


@router.get("/buildings/{code}/links")
def of_building(request: Request, code: Code, sessions: Reading, _: Visitor) -> Response:
    """The links to the building, and the form to make one."""
    return _listed(request, code, sessions)


def _listed(request: Request, code: str, sessions: sessionmaker[Session], refused: Refused = NOT_REFUSED) -> Response:
    """The links to the building, with the form if it was refused."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        listed = [link_out(one) for one in links.every(session, building.id)]
        now, days = datetime.now(UTC), (links.DAYS, links.MOST_DAYS)
        return page(
            request, "links", refused.status, refused=refused, building=building, links=listed, now=now, days=days
        )


@router.post("/buildings/{code}/links")
def make(request: Request, code: Code, sessions: Writing, by: By, form: Making) -> Response:
    """Make a link, and show its address this once."""

    def act(wanted: LinkRequest) -> Response:
        with sessions.begin() as session:
            building, _ = building_queries.building(session, code)
            link, token = links.create(session, building, wanted.name, by.name, datetime.now(UTC), wanted.days)
            shown = link_out(link)
        made = links.address(public_address(request), token)
        answer = page(request, "link_made", 201, building=building, link=shown, address=made)
        answer.headers.update(SECRETIVE)
        return answer

    return answered("link", form, act, lambda refused: _listed(request, code, sessions, refused))


@router.post("/links/{link_id}/revoke")
def revoke(request: Request, link_id: LinkId, sessions: Writing, _: By) -> Response:
    """Revoke a link, and show the others."""
    with sessions.begin() as session:
        code = links.revoke(session, link_id, datetime.now(UTC)).building.code
    request.app.state.callers.forget()
    return RedirectResponse(f"/buildings/{code}/links", 303)
