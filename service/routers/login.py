"""How people with a browser come in: their key, posted once, becomes a cookie that no script can read."""

import re
from datetime import timedelta
from typing import Annotated, Literal, TypedDict
from urllib.parse import parse_qs, urlencode

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from service.access.auth import COOKIE, Caller, digest, is_cross_site, viewer
from service.errors import ForbiddenError, LoginWantedError, UnauthorizedError
from service.pages.rendering import page
from service.web import bodies

OURS = re.compile(r"/([a-z]+(/[\w-]+)*)?(\?[\w=&%.-]*)?", re.ASCII)
MOST = 4096
"""Bytes of a posted form."""
LASTS = timedelta(days=30)
UNKNOWN = (
    "No key in force is like that. A key begins with mk_ and is shown once, when 'menshin key create NAME "
    "--role viewer' makes it; a revoked one no longer works."
)

router = APIRouter(include_in_schema=False)


class Flags(TypedDict):
    """Who gets to see a cookie."""

    httponly: bool
    samesite: Literal["strict"]
    secure: bool


async def reader(request: Request) -> Caller:
    """A dependency of pages: who may read passes, who has no key yet is sent to the form.

    Raises
    ------
    LoginWantedError
        A key is wanted.
    ForbiddenError
        A key would not do.
    """
    try:
        return await viewer(request)
    except UnauthorizedError as error:
        wanted = request.url.path + (f"?{request.url.query}" if request.url.query else "")
        raise LoginWantedError(f"/login?{urlencode({'next': onward(wanted)})}") from error


def onward(wanted: str) -> str:
    """The page to go on to: one of ours, or the first one; never another site's."""
    return wanted if OURS.fullmatch(wanted) else "/"


@router.get("/login")
async def form(request: Request, next: Annotated[str, Query(max_length=MOST)] = "/") -> Response:
    """The form that asks for a key."""
    return page(request, "login", onward=onward(next))


@router.post("/login")
async def log_in(request: Request) -> Response:
    """Keep a good key in a cookie and go on; ask again for another."""
    refuse_other_sites(request)
    posted = parse_qs(await bodies.text(request, MOST))
    key, wanted = ((posted.get(name) or [""])[-1].strip() for name in ("key", "next"))
    if digest(key) not in await request.app.state.keys.in_force():
        return page(request, "login", 401, onward=onward(wanted), refusal=UNKNOWN)
    answer = RedirectResponse(onward(wanted), 303)
    answer.set_cookie(COOKIE, key, LASTS // timedelta(seconds=1), **flags(request))
    return answer


@router.post("/logout")
async def log_out(request: Request) -> Response:
    """Let the browser forget the key."""
    refuse_other_sites(request)
    answer = RedirectResponse("/login", 303)
    answer.delete_cookie(COOKIE, **flags(request))
    return answer


def refuse_other_sites(request: Request) -> None:
    """Another site's page must not log anybody in or out."""
    if is_cross_site(request):
        raise ForbiddenError("The form was sent by a page of another site.")


def flags(request: Request) -> Flags:
    """No script reads the cookie, no other site's page sends it, and what came by https goes by https only.

    Behind a proxy that speaks https for us only the browser's own Origin tells.
    """
    secure = request.url.scheme == "https" or request.headers.get("origin", "").startswith("https://")
    return {"httponly": True, "samesite": "strict", "secure": secure}
