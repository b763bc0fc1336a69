"""Capture of the beginning of each request body for the audit trail."""

from typing import Any

import orjson
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.forms import fields_of

MOST = 16 * 1024
"""Bytes of a body that are captured; the audit trail has no details of longer ones."""
BODY = "menshin.body"
READ_ONLY = frozenset({"GET", "HEAD", "OPTIONS"})


class RequestCapture:
    """Middleware that keeps the beginning of every body in the request's scope."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on and capture its body."""
        if scope["type"] != "http" or scope["method"] in READ_ONLY:
            await self._app(scope, receive, send)
            return
        body = scope[BODY] = bytearray()

        async def capturing() -> Message:
            message = await receive()
            body.extend(message.get("body", b"")[: MOST + 1 - len(body)])
            return message

        await self._app(scope, capturing, send)


def captured(scope: Scope) -> dict[str, Any]:
    """A JSON object or the fields of a form; empty for anything else, or a longer body."""
    body = bytes(scope.get(BODY, b""))
    if not body or len(body) > MOST:
        return {}
    try:
        content = orjson.loads(body)
    except orjson.JSONDecodeError:
        return fields_of(body.decode("utf-8", "replace"))
    return content if isinstance(content, dict) else {}
