"""Error pages for browsers, with a link back; programs receive problem documents."""

import re
from collections.abc import Awaitable, Callable
from http import HTTPStatus
from typing import Any
from urllib.parse import urlencode, urlsplit

import orjson
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import WebSocketRequestValidationError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from service.access.auth import SAFE
from service.access.pages import onward
from service.errors import ServiceError
from service.http import problems
from service.http.problems import PROBLEM
from service.http.rendering import page

OF_PROGRAMS = ("/api/", "/fdsnws/", "/metrics", "/healthz", "/readyz", "/openapi.json", "/static/")
PATTERN = re.compile(r"String should match pattern '.*?'(?=[;.]|$)")
"""pydantic's message for a text that does not match a pattern, which people need not see."""
WORDS = {
    404: "There is nothing at this address.",
    405: "This address cannot be used in that way.",
    500: "Something went wrong in Menshin; its log has the details.",
}
LOGGED_OUT = "You are logged out"
ENDED = "This browser is not logged in: its session has ended, or its key was revoked. Nothing was done."


def wants_page(request: Request) -> bool:
    """True if the request comes from a person: a browser that accepts HTML requests the address of a page."""
    return "text/html" in request.headers.get("accept", "") and not request.url.path.startswith(OF_PROGRAMS)


def service_problem(request: Request, error: ServiceError) -> Response:
    """The response to a rejected request, as a page or as a problem document."""
    answer = problems.service_problem(request, error)
    return as_page(request, answer, is_unknown=False) if wants_page(request) else answer


def install(app: FastAPI) -> None:
    """Add a page to every error that has a problem document."""
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
    """The page for a problem document; that of a form links back to the form's page."""
    status, is_form = answer.status_code, request.method not in SAFE
    document = orjson.loads(bytes(answer.body))
    is_malformed = "errors" in document
    said = WORDS.get(status) if is_unknown or is_malformed or status == 500 else None
    detail = said or PATTERN.sub("this does not have the required form", document["detail"])
    title, back, login = HTTPStatus(status).phrase, form_page(request) if is_form else "/", None
    if is_form and status == HTTPStatus.UNAUTHORIZED:
        title, detail, login = LOGGED_OUT, ENDED, f"/login?{urlencode({'next': back})}"
    shown = page(request, "error", status, title=title, detail=detail, back=back, login=login, is_form=is_form)
    for name, value in answer.headers.items():
        if name not in ("content-length", "content-type"):
            shown.headers[name] = value
    return shown


def form_page(request: Request) -> str:
    """Address on this server of the page that a form was sent from; the first page where the browser does not say.

    A refused form is shown at the address that it was sent to, which has no GET: then it is the page above.
    """
    came = urlsplit(request.headers.get("referer", ""))
    if came.netloc != request.headers.get("host"):
        return "/"
    if _is_page(request, came.path):
        return onward(f"{came.path}?{came.query}" if came.query else came.path)
    path = came.path
    while path and not _is_page(request, path):
        path = path.rpartition("/")[0]
    return onward(path or "/")


def _is_page(request: Request, path: str) -> bool:
    scope = {**request.scope, "method": "GET", "path": path}
    return any(route.matches(scope)[0] is Match.FULL for route in request.app.routes)
