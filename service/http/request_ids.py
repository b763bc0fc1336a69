"""The identity of each request: in the log, and in the header X-Request-ID of its answer."""

import re
from uuid import uuid4

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import logs

HEADER = "X-Request-ID"
ACCEPTED = re.compile(r"[A-Za-z0-9._-]{1,64}")
"""Identities that a proxy or a program may give; others are replaced."""
IDENTITY = "menshin.request"
"""Key of the identity in the request's scope."""


class RequestIds:
    """Middleware that takes the identity of a request from its header, or makes one."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on; the log's lines of its task have its identity."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        identity = scope[IDENTITY] = given if ACCEPTED.fullmatch(given) else uuid4().hex
        logs.are_about(request=identity)  # not within a context: the server logs a bug after this returns

        async def naming(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)[HEADER] = identity
            await send(message)

        await self._app(scope, receive, naming)
