"""Who is asking, and what they may do.

A key is 256 random bits, so a plain SHA-256 of it cannot be searched; only that is stored. Without any key the service
answers programs on its own machine, and nobody else.
"""

import hashlib
import ipaddress
import secrets
import time
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any
from urllib.parse import urlsplit

from anyio import to_thread
from fastapi import Request
from sqlalchemy.orm import Session, sessionmaker

from service.errors import ForbiddenError, UnauthorizedError
from service.queries import access

PREFIX = "mk_"
VISIBLE = 11
"""Characters of a key that lists show: the prefix and 8 of its 43."""
COOKIE = "menshin_key"
FRESH = 1.0
"""s, for which a process remembers the keys: a revoked one works for that long at most."""
FORWARDED = ("forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-real-ip")
SAFE = frozenset({"GET", "HEAD", "OPTIONS"})


class Role(IntEnum):
    """What a key may do; each includes those before it."""

    viewer = 1
    """Read."""
    engineer = 2
    """Ask for analyses as well."""
    admin = 3
    """Everything."""


@dataclass(frozen=True, slots=True)
class Caller:
    """Who is asking."""

    name: str
    role: Role


LOCAL = Caller("loopback", Role.admin)


def new_key() -> str:
    """A key with 256 random bits."""
    return PREFIX + secrets.token_urlsafe(32)


def digest(key: str) -> str:
    """What is stored of a key: its visible beginning and its SHA-256."""
    return f"{key[:VISIBLE]}:{hashlib.sha256(key.encode()).hexdigest()}"


class Keys:
    """The keys in force, read from the database at most once per FRESH seconds."""

    def __init__(self, sessions: sessionmaker[Session], clock: Callable[[], float] = time.monotonic) -> None:
        self._sessions = sessions
        self._clock = clock
        self._read_at = -float("inf")
        self._callers: Mapping[str, Caller] = {}

    async def in_force(self) -> Mapping[str, Caller]:
        """Callers by the digest of their key."""
        if self._clock() - self._read_at > FRESH:
            self._callers = await to_thread.run_sync(self._read)
            self._read_at = self._clock()
        return self._callers

    def _read(self) -> Mapping[str, Caller]:
        with self._sessions() as session:
            return {key.hash: Caller(key.name, Role[key.role]) for key in access.keys_in_force(session)}


def presented(request: Request) -> set[str]:
    """What came with a request as its key: of every header that may hold one, or else the cookie's."""
    scheme, _, token = request.headers.get("authorization", "").partition(" ")
    bearer = token.strip() if scheme.lower() == "bearer" else request.headers.get("authorization")
    headers = {key for key in (bearer, request.headers.get("x-api-key")) if key is not None}
    return headers or {request.cookies[name] for name in {COOKIE} & request.cookies.keys()}


def is_loopback(host: str | None) -> bool:
    """Whether a host, as in an address or a Host header without its port, is this machine itself."""
    if host == "localhost":
        return True
    try:
        return host is not None and ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_local(request: Request) -> bool:
    """Whether a program on this machine asks directly.

    The client's address alone does not tell: a proxy on this machine passes strangers on, and a stranger's page whose
    name was rebound to 127.0.0.1 asks through the user's own browser, but with its own name in the Host header.
    """
    client = request.client.host if request.client else None
    named = urlsplit(f"//{request.headers.get('host', '')}").hostname
    return is_loopback(client) and is_loopback(named) and not any(header in request.headers for header in FORWARDED)


def is_cross_site(request: Request) -> bool:
    """Whether a page of another site makes the browser change something here."""
    origin = request.headers.get("origin")
    return request.method not in SAFE and origin is not None and urlsplit(origin).netloc != request.headers.get("host")


def caller(request: Request) -> Caller:
    """Who asked, of a request that was let in."""
    found: Caller = request.state.caller
    return found


async def identify(request: Request) -> Caller:
    """Who is asking; the request remembers it.

    Raises
    ------
    UnauthorizedError
        The service has keys and none of them came with the request, or a wrong one beside it.
    ForbiddenError
        The service has no key and the request is not from this machine, or it was made by another site's page.
    """
    if is_cross_site(request):
        raise ForbiddenError("The request was made by a page of another site.")
    keys: Mapping[str, Caller] = await request.app.state.keys.in_force()
    if not keys:
        if is_local(request):
            request.state.caller = LOCAL
            return LOCAL
        raise ForbiddenError(
            "The service has no API key yet, so it answers only programs on its own machine that ask it directly, "
            "as localhost. 'menshin key create NAME --role viewer' there makes a key."
        )
    given = presented(request)
    if not given or any(digest(key) not in keys for key in given):
        found = "An unknown or revoked API key" if given else "No API key"
        raise UnauthorizedError(
            f"{found} came with the request; 'Authorization: Bearer KEY' or 'X-API-Key: KEY' would do."
        )
    callers: list[Caller] = [keys[digest(key)] for key in given]
    request.state.caller = min(callers, key=lambda one: one.role)
    return caller(request)


def at_least(role: Role) -> Callable[[Request], Coroutine[Any, Any, Caller]]:
    """A dependency that lets callers of this role, or a higher one, pass."""

    async def require(request: Request) -> Caller:
        caller = await identify(request)
        if caller.role < role:
            raise ForbiddenError(
                f"The key {caller.name!r} is a {caller.role.name}'s; this takes a key of role {role.name}."
            )
        return caller

    return require


viewer, engineer, admin = (at_least(role) for role in Role)
