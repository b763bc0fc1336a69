"""Admission of requests: callers are identified before a body is read, and each has a limited share of the server.

- A request that changes data is refused by its head alone, unless it has a valid key or session.
- Bodies are counted as they arrive, whatever length their head declares.
- Each caller has a share of the requests and streams in progress, so that one alone cannot block the others.
- A stream ends when its key is revoked or its session ends, and when the server does.
- Every response has headers that restrict browsers.
"""

import asyncio
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from threading import Event as Signal

from anyio import CancelScope, Semaphore, current_time, move_on_after, sleep
from fastapi import Request, Response
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access import auth
from service.access.roles import ends_soon
from service.errors import ServiceError, TooLargeError
from service.http import problems

OPEN = frozenset(
    {
        "/healthz",
        "/readyz",
        "/login",
        "/login/provider",
        "/login/callback",
        "/link",
        "/logout",
        "/language",
        "/openapi.json",
    }
)
"""Paths that need no key; `/static/` needs none either."""
BODY = 64 * 2**10
"""Largest body in bytes, except that of a posted request to /fdsnws."""
FDSN_BODY = 2**20
"""Largest body of a posted request to /fdsnws, bytes."""
UPLOAD = 16 * 2**20
"""Largest body of an uploaded ground motion, bytes: an hour of three components at 200 samples a second, as text."""
UPLOADS = re.compile(r"/models/\d{1,10}/forecast|/api/v1/models/\d{1,10}/forecasts/uploaded", re.ASCII)
"""Paths that ground motions are uploaded to."""
REQUESTS = 8
"""Requests of one caller in progress at the same time; fewer than the database has connections."""
STREAMS = 16
"""Streams of one caller at the same time."""
PATIENCE = 15.0
"""s that a request waits for its caller's other requests."""
LOOK = 1.0
"""s between two checks of a stream's permission."""
PROTECTION = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",  # with no-referrer the service's own forms would send 'Origin: null'
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox",
}
"""Default headers of responses; pages have their own policy."""
TOO_LONG = "The body is longer than the {} bytes accepted here."
TOO_MANY = "Too many requests of the same caller are in progress; try again when they have been answered."
BUSY = {"Retry-After": "5"}


class TooManyError(ServiceError):
    """The caller exceeds its share."""

    status = 429
    headers = BUSY


class Share:
    """Requests of one caller in progress."""

    def __init__(self) -> None:
        self.requests = Semaphore(REQUESTS)
        self.streams = 0
        self.users = 0


class Guard:
    """The application, behind checks that every request must pass."""

    def __init__(
        self,
        app: ASGIApp,
        ending: Signal,
        refusal: Callable[[Request, ServiceError], Response] = problems.service_problem,
    ) -> None:
        """
        Args:
            app: behind the guard.
            ending: set when the server ends, which ends streams too.
            refusal: makes the response to a refused request.
        """
        self._app, self._ending, self._refusal = app, ending, refusal
        self._shares: dict[str, Share] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Admit the request, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        send = _with_default_headers(request, send)
        if request.url.path == "/healthz":
            await self._app(scope, _limited_body(request, receive), send)
            return
        try:
            who = await self._admit(request)
            async with self._share(who) as share:
                await Turn(self, request, share).answer(scope, _limited_body(request, receive), send)
        except ServiceError as error:
            await self._refusal(request, error)(scope, receive, send)
        except problems.UNREACHABLE as error:
            await problems.database_problem(request, error)(scope, receive, send)
        except ClientDisconnect:
            return

    async def forward(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application."""
        await self._app(scope, receive, send)

    @property
    def is_ending(self) -> bool:
        """True if the server is shutting down."""
        return self._ending.is_set()

    async def _admit(self, request: Request) -> str:
        """The caller's share that the request belongs to.

        Raises:
            ServiceError: it changes data without a known caller, or its declared body is too long.
        """
        stranger = f"at {request.client.host if request.client else 'an unknown address'}"
        if _is_open(request.url.path):
            return stranger
        try:
            who = (await auth.identify(request)).name
        except ServiceError:
            if request.method not in auth.SAFE:
                raise
            return stranger  # the path decides: pages redirect people to the login form
        declared = request.headers.get("content-length", "0")
        if not _is_fdsn_request(request) and declared.isdigit() and int(declared) > _most(request):
            raise TooLargeError(TOO_LONG.format(_most(request)))
        return who

    @asynccontextmanager
    async def _share(self, who: str) -> AsyncIterator[Share]:
        share = self._shares.setdefault(who, Share())
        share.users += 1
        try:
            yield share
        finally:
            share.users -= 1
            if not share.users:
                self._shares.pop(who, None)


class Turn:
    """One request in its caller's share: it occupies a place until it is answered or becomes a stream."""

    def __init__(self, guard: Guard, request: Request, share: Share) -> None:
        self._guard, self._request, self._share = guard, request, share
        self._holds_place = self._is_stream = self._has_ended = False
        self._scope = CancelScope()
        self._watch: asyncio.Task[None] | None = None

    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Wait for a place and call the application.

        Raises:
            TooManyError: the caller's other requests take too long, or it has too many streams already.
        """
        with move_on_after(PATIENCE):
            await self._share.requests.acquire()
            self._holds_place = True
        if not self._holds_place:
            raise TooManyError(TOO_MANY)

        async def noting(message: Message) -> None:
            if message["type"] == "http.response.start" and _is_stream(message):
                self._become_stream()
            self._has_ended = message["type"] == "http.response.body" and not message.get("more_body", False)
            await send(message)

        try:
            with self._scope:
                await self._guard.forward(scope, receive, noting)
        except ExceptionGroup as group:
            if group.subgroup(TooManyError) is None:
                raise
            raise TooManyError(TOO_MANY) from None  # the stream's own tasks wrap it
        else:
            if self._scope.cancelled_caught and not self._has_ended:
                await send({"type": "http.response.body", "body": b"", "more_body": False})
        finally:
            self._leave()

    def _become_stream(self) -> None:
        """Count a stream among the streams instead of the requests, because it waits most of the time."""
        if self._share.streams >= STREAMS:
            raise TooManyError(TOO_MANY)
        self._share.streams += 1
        self._is_stream = True
        self._release_place()
        self._watch = asyncio.create_task(self._end_in_time())

    async def _end_in_time(self) -> None:
        """Cancel the stream when its caller loses access, or the server ends."""
        looked = current_time()
        while not self._guard.is_ending:
            await sleep(LOOK / 10)
            if current_time() - looked > LOOK:
                looked = current_time()
                try:
                    if not await auth.is_valid(self._request):
                        break
                except problems.UNREACHABLE:
                    continue
        self._scope.cancel()

    def _release_place(self) -> None:
        if self._holds_place:
            self._share.requests.release()
            self._holds_place = False

    def _leave(self) -> None:
        self._release_place()
        if self._is_stream:
            self._share.streams -= 1
        if self._watch is not None:
            self._watch.cancel()


def _is_open(path: str) -> bool:
    return path in OPEN or path.startswith("/static/")


def _is_fdsn_request(request: Request) -> bool:
    return request.url.path.startswith("/fdsnws/")


def _most(request: Request) -> int:
    if UPLOADS.fullmatch(request.url.path):
        return UPLOAD
    return FDSN_BODY if _is_fdsn_request(request) else BODY


def _is_stream(message: Message) -> bool:
    return Headers(raw=message["headers"]).get("content-type", "").startswith("text/event-stream")


def _limited_body(request: Request, receive: Receive) -> Receive:
    """The body as it arrives, up to the limit."""
    count = 0

    async def counting() -> Message:
        nonlocal count
        message = await receive()
        count += len(message.get("body", b""))
        if count > _most(request):
            raise HTTPException(413, TOO_LONG.format(_most(request)))
        return message

    return counting


def _with_default_headers(request: Request, send: Send) -> Send:
    """Responses with the default headers, and a warning of the end of the caller's key."""

    async def protecting(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in PROTECTION.items():
                headers.setdefault(name, value)
            end = auth.caller(request).expires_at
            if end is not None and ends_soon(end, datetime.now(UTC)):
                headers["Menshin-Key-Expires"] = f"{end:%Y-%m-%dT%H:%M:%SZ}"
        await send(message)

    return protecting
