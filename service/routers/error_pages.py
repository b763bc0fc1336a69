"""Errors as people at a browser see them: a page with words and a way back; programs get a problem document."""

import re
from collections.abc import Awaitable, Callable
from http import HTTPStatus
from typing import Any

import orjson
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import WebSocketRequestValidationError
from starlette.exceptions import HTTPException

from service.errors import PROBLEM
from service.pages.rendering import page

OF_PROGRAMS = ("/api/", "/fdsnws/", "/metrics", "/healthz", "/readyz", "/openapi.json", "/static/")
PATTERN = re.compile(r"String should match pattern '.*?'(?=[;.]|$)")
"""What pydantic says of a text that an expression does not match; people are shown no expression."""
WORDS = {
    404: "There is nothing at this address.",
    405: "This address cannot be used in that way.",
    500: "Something went wrong in Menshin; its log has the details.",
}


def wants_page(request: Request) -> bool:
    """Whether a person asks: a browser says that it takes HTML, and the address is that of a page."""
    return "text/html" in request.headers.get("accept", "") and not request.url.path.startswith(OF_PROGRAMS)


def install(app: FastAPI) -> None:
    """Let every error that has a problem document so far have a page beside it."""
    of_requests = {k: h for k, h in app.exception_handlers.items() if k is not WebSocketRequestValidationError}
    for kind, handler in of_requests.items():
        app.add_exception_handler(kind, _paged(handler))


def _paged(handler: Callable[..., Any]) -> Callable[[Request, Exception], Awaitable[Response]]:
    async def answered(request: Request, error: Exception) -> Response:
        made = handler(request, error)
        answer: Response = await made if hasattr(made, "__await__") else made
        if answer.media_type != PROBLEM or answer.status_code < HTTPStatus.BAD_REQUEST or not wants_page(request):
            return answer
        return as_page(request, answer, is_unknown=isinstance(error, HTTPException))

    return answered


def as_page(request: Request, answer: Response, *, is_unknown: bool) -> Response:
    """The page that says what a problem document says."""
    status = answer.status_code
    document = orjson.loads(bytes(answer.body))
    is_malformed = "errors" in document
    said = WORDS.get(status) if is_unknown or is_malformed or status == 500 else None
    detail = said or PATTERN.sub("this is not in the form that is needed", document["detail"])
    shown = page(request, "error", status, title=HTTPStatus(status).phrase, detail=detail)
    for name, value in answer.headers.items():
        if name not in ("content-length", "content-type"):
            shown.headers[name] = value
    return shown
