"""Login pages: an API key or a one-time link starts a browser session, which is stored on the server."""

import re
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import replace
from datetime import UTC, datetime
from math import ceil
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict
from urllib.parse import urlencode

from anyio import to_thread
from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from service.access import logins
from service.access.auditing import AuditContext, note
from service.access.auth import COOKIE, LINK, SAFE_COOKIE, SAFE_LINK, Caller, is_cross_site, is_secure, login, viewer
from service.access.logins import NewSession
from service.errors import ForbiddenError, LoginRequiredError, UnauthorizedError
from service.http.forms import NOT_REFUSED, Posted, Refused, posted
from service.http.rendering import page

if TYPE_CHECKING:
    from service.access.provider import Provider  # authlib takes long to load

OURS = re.compile(r"/([a-z]+(/[\w-]+)*)?(\?[\w=&%.-]*)?", re.ASCII)
MOST = 4096
"""Largest posted form, bytes."""
UNKNOWN = (
    "No valid key matches this one. A key begins with mk_ and is shown once, when 'menshin key create NAME "
    "--role viewer' makes it; a revoked one no longer works."
)
SPENT = "This link was used before, or is more than an hour old; 'menshin login' makes a new one."
TOO_OFTEN = "Too many attempts from this address were refused; in a minute it may try again."

router = APIRouter(include_in_schema=False)


class Flags(TypedDict):
    """Attributes of a cookie."""

    httponly: bool
    samesite: Literal["strict"]
    secure: bool


def page_for(admitted: Callable[[Request], Awaitable[Caller]]) -> Callable[[Request], Coroutine[Any, Any, Caller]]:
    """A dependency of pages for the callers that another one admits.

    A browser without a session is redirected to the login form.
    """

    async def visitor(request: Request) -> Caller:
        try:
            return await admitted(request)
        except UnauthorizedError as error:
            wanted = request.url.path + (f"?{request.url.query}" if request.url.query else "")
            raise LoginRequiredError(f"/login?{urlencode({'next': onward(wanted)})}") from error

    return visitor


reader = page_for(viewer)


def onward(wanted: str) -> str:
    """The page after the login: the requested one if it is on this server, otherwise the first page."""
    return wanted if OURS.fullmatch(wanted) else "/"


@router.get("/login")
async def form(
    request: Request,
    next: Annotated[str, Query(max_length=MOST)] = "/",
    token: Annotated[str | None, Query(max_length=MOST)] = None,
) -> Response:
    """The login form; with the token of a link, a login at once."""
    if token is None:
        return login_form(request, next)
    return await start_session(request, token, is_link=True, wanted=next)


class LoginForm(BaseModel):
    """A key, and the page to go on to."""

    key: str = ""
    next: str = ""


async def of_this_site(request: Request) -> None:
    """Refuse posts from other sites' pages, which could log people in or out."""
    if is_cross_site(request):
        raise ForbiddenError("The form was sent by a page of another site.")


LoginPosted = Annotated[Posted[LoginForm], Depends(posted(LoginForm, MOST))]


@router.post("/login", dependencies=[Depends(of_this_site)])
async def log_in(request: Request, sent: LoginPosted) -> Response:
    """Start a session for a valid key and redirect; otherwise show the form again."""
    wanted = sent.checked()
    return await start_session(request, wanted.key, is_link=False, wanted=wanted.next)


@router.post("/logout", dependencies=[Depends(of_this_site)])
async def log_out(request: Request) -> Response:
    """End the session on the server and in the browser."""
    if (session := login(request)) is not None:
        await to_thread.run_sync(_end, request, session)
        request.app.state.callers.forget()
    answer = RedirectResponse("/login", 303)
    for name in (COOKIE, SAFE_COOKIE, LINK, SAFE_LINK):
        answer.delete_cookie(name, **flags(secure=name in (SAFE_COOKIE, SAFE_LINK)))
    return answer


async def start_session(request: Request, secret: str, *, is_link: bool, wanted: str) -> Response:
    """Redirect with a new session, or show the form again; an address with too many refused attempts must wait."""
    if (waiting := must_wait(request, wanted)) is not None:
        return waiting
    cookie = await to_thread.run_sync(_new_session, request, secret, is_link)
    if cookie is None:
        request.app.state.attempts.refuse(address_of(request))
        why = Refused("login", words=SPENT) if is_link else Refused("login", problems={"key": UNKNOWN})
        return login_form(request, wanted, replace(why, status=401))
    answer = RedirectResponse(onward(wanted), 303)
    keep(request, answer, cookie)
    return answer


def must_wait(request: Request, wanted: str) -> Response | None:
    """The answer to an address with too many refused attempts; None for every other."""
    wait = ceil(request.app.state.attempts.wait(address_of(request)))
    if not wait:
        return None
    answer = login_form(request, wanted, Refused("login", words=TOO_OFTEN, status=429))
    answer.headers["Retry-After"] = str(wait)
    return answer


def keep(request: Request, answer: Response, cookie: str) -> None:
    """Give a browser the cookie of its new session."""
    request.app.state.callers.forget()
    secure = is_secure(request)
    lasts = int(request.app.state.settings.login.lifetime)
    answer.set_cookie(SAFE_COOKIE if secure else COOKIE, cookie, lasts, **flags(secure=secure))


def login_form(request: Request, wanted: str, refused: Refused = NOT_REFUSED) -> Response:
    """The login form, with the reason why the last attempt was refused."""
    provider: Provider | None = request.app.state.provider
    shown = None if provider is None else provider.settings.name
    return page(request, "login", refused.status, onward=onward(wanted), refused=refused, provider=shown)


def _new_session(request: Request, secret: str, is_link: bool) -> str | None:
    """Value of the new session's cookie; the audit trail records the attempt, accepted or refused."""
    now = datetime.now(UTC)
    with request.app.state.sessions.begin() as session:
        begun = logins.follow(session, secret, now) if is_link else logins.begin(session, secret, now)
        note_session(session, request, begun)
    return None if begun is None else begun.cookie


def note_session(session: Session, request: Request, begun: NewSession | None, **details: object) -> None:
    """Record a login or a refused attempt in the audit trail; a new session replaces the browser's earlier one."""
    if begun is None:
        _note(session, request, "unknown", "refused", **details)
        return
    if (earlier := login(request)) is not None and (name := logins.end(session, earlier, datetime.now(UTC))):
        _note(session, request, name, "ended")
    _note(session, request, begun.name, "begun", **details)


def _end(request: Request, session_digest: str) -> None:
    now = datetime.now(UTC)
    with request.app.state.sessions.begin() as session:
        if name := logins.end(session, session_digest, now):
            _note(session, request, name, "ended")


def _note(session: Session, request: Request, by: str, what: str, **details: object) -> None:
    said = {"session": what, **details}
    audit_context = AuditContext(by, address_of(request), request.method, request.url.path, said)
    note(session, audit_context, datetime.now(UTC))


def address_of(request: Request) -> str:
    """Address of the client."""
    return request.client.host if request.client else "unknown"


def flags(*, secure: bool) -> Flags:
    """Cookie attributes: no script reads it, no other site sends it, and over https it is sent over https only."""
    return {"httponly": True, "samesite": "strict", "secure": secure}
