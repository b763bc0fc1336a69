"""Authentication: the caller of a request and the caller's role.

A request carries an API key in a header, or the cookie of a browser that has logged in. Its origin proves nothing: a
proxy on this machine forwards requests of strangers and can set any header.
"""

from collections.abc import Callable, Coroutine
from typing import Any
from urllib.parse import urlsplit

from fastapi import Request

from service.access.callers import Callers, Snapshot
from service.access.roles import Caller as Caller, Role as Role, digest
from service.addresses import is_loopback
from service.errors import ForbiddenError, UnauthorizedError

COOKIE, SAFE_COOKIE = "menshin", "__Host-menshin"
LINK, SAFE_LINK = "menshin-link", "__Host-menshin-link"
"""Names of the cookies of a session and of a link, for plain http on loopback and for https: browsers accept those for
https from this host over https only."""
FORWARDED = ("forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-real-ip")
REFRESH = "menshin-refresh"
"""Header of a page that looks for news by itself, which does not keep a browser's session from ending unused."""
SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
NO_KEY = (
    "'Authorization: Bearer KEY' or 'X-API-Key: KEY' is needed; 'menshin key create NAME --role viewer' makes a key, "
    "and 'menshin login' a link for a browser."
)


def presented(request: Request) -> set[str]:
    """API keys in the headers of a request."""
    scheme, _, token = request.headers.get("authorization", "").partition(" ")
    bearer = token.strip() if scheme.lower() == "bearer" else request.headers.get("authorization")
    return {key for key in (bearer, request.headers.get("x-api-key")) if key is not None}


def is_secure(request: Request) -> bool:
    """True if the browser uses https, directly or to a proxy that the settings trust or that says so.

    A form's Origin also shows it; a request that only reads has none.
    """
    public = urlsplit(request.app.state.settings.public_url or "")
    is_public = public.scheme == "https" and public.netloc == request.headers.get("host")
    return request.url.scheme == "https" or is_public or request.headers.get("origin", "").startswith("https://")


def login(request: Request) -> str | None:
    """Digest of the session in the browser's cookie, None without a cookie; over https only the safe cookie counts."""
    return _cookie(request, SAFE_COOKIE, COOKIE)


def link(request: Request) -> str | None:
    """Digest of the link to a building in the browser's cookie, None without a cookie."""
    return _cookie(request, SAFE_LINK, LINK)


def _cookie(request: Request, safe: str, plain: str) -> str | None:
    names = (safe,) if is_secure(request) else (safe, plain)
    cookie = next((request.cookies[name] for name in names if name in request.cookies), None)
    return None if cookie is None else digest(cookie)


def seems_local(request: Request) -> bool:
    """True if the request seems to come directly from this machine: enough for a demonstration, but no proof.

    A stranger's page whose name was rebound to 127.0.0.1 asks with its own name in the Host header; a proxy may ask
    with whatever name and headers it likes.
    """
    client = request.client.host if request.client else None
    named = urlsplit(f"//{request.headers.get('host', '')}").hostname
    return is_loopback(client) and is_loopback(named) and not any(header in request.headers for header in FORWARDED)


def is_cross_site(request: Request) -> bool:
    """True if the page of another site makes the browser change something here."""
    origin = request.headers.get("origin")
    return request.method not in SAFE and origin is not None and urlsplit(origin).netloc != request.headers.get("host")


NOBODY = Caller("nobody", Role.viewer, frozenset())
"""Stands for the caller of a request that was not admitted: no building exists for it."""


def caller(request: Request) -> Caller:
    """The caller of an admitted request, limited to the buildings on which it has the role that the request needs."""
    acting: Caller = getattr(request.state, "acting", getattr(request.state, "caller", NOBODY))
    return acting


def is_narrowed(request: Request) -> bool:
    """True if the caller has the role that the request needs on some of its buildings alone."""
    return caller(request) != getattr(request.state, "caller", NOBODY)


async def identify(request: Request) -> Caller:
    """The caller of a request, which remembers it.

    Raises:
        UnauthorizedError: neither a valid key nor a valid session came with the request, or a wrong key beside a right
            one.
        ForbiddenError: it was made by another site's page.
    """
    known: Caller | None = getattr(request.state, "caller", None)
    if known is not None:
        return known
    if is_cross_site(request):
        raise ForbiddenError("The request was made by a page of another site.")
    callers: Callers = request.app.state.callers
    identified = request.state.caller = _caller(request, await callers.known())
    used = {digest(key) for key in presented(request)}
    if REFRESH not in request.headers:
        used |= {cookie for cookie in (login(request), link(request)) if cookie is not None}
    for secret in used:
        callers.note_use(secret)
    return identified


async def is_valid(request: Request) -> bool:
    """True if an admitted caller may still read; for long responses, such as streams."""
    begun: Caller = request.state.caller
    try:
        return begun == _caller(request, await request.app.state.callers.known())
    except UnauthorizedError:
        return False


def _caller(request: Request, known: Snapshot) -> Caller:
    given = {digest(key) for key in presented(request)}
    if given and not given <= known.keys.keys():
        raise UnauthorizedError(f"An unknown, revoked or expired API key came with the request; {NO_KEY}")
    if given:
        return min((known.keys[one] for one in given), key=lambda one: one.role)
    if (session := login(request)) is not None and session in known.logins:
        return known.logins[session]
    if (opened := link(request)) is not None and opened in known.links:
        return known.links[opened]
    visitor: Caller | None = request.app.state.visitor
    if visitor is not None and not known.has_had_keys and seems_local(request):
        return visitor
    raise UnauthorizedError(f"No API key came with the request; {NO_KEY}")


def at_least(role: Role) -> Callable[[Request], Coroutine[Any, Any, Caller]]:
    """A dependency that admits callers with this role or a higher one on some building, and limits them to these."""

    async def require(request: Request) -> Caller:
        await identify(request)
        known = caller(request)
        acting = known.at_least(role)
        if acting is None:
            raise ForbiddenError(
                f"The key {known.name!r} is a {known.role.name}'s; this request needs a key of role {role.name}."
            )
        request.state.acting = acting
        return acting

    return require


viewer, engineer, admin = (at_least(role) for role in Role)


async def administrator(request: Request) -> Caller:
    """A dependency that admits admins of all buildings: who makes keys could give themselves any building."""
    acting = await admin(request)
    if acting.buildings is not None:
        raise ForbiddenError(f"{acting.name!r} is an admin of some buildings; keys need an admin of all of them.")
    return acting
