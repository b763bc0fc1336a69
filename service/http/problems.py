"""HTTP errors as problem documents (RFC 9457)."""

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import orjson
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import InterfaceError, OperationalError, SQLAlchemyError, TimeoutError as PoolTimeoutError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from service.access.auth import is_narrowed
from service.db.problems import problem as database_reason, undone
from service.errors import NotFoundError, ServiceError
from service.http.request_ids import HEADER, IDENTITY

log = logging.getLogger(__name__)

PROBLEM = "application/problem+json"
DETAIL = {
    404: "This path does not exist; /docs lists the paths.",
    405: "This path does not support the method; the header Allow lists the supported ones.",
    500: "Internal error; the service's log has the details.",
}
ROLE_TOO_LOW = " If it exists, your role there is too low for this request."
UNREACHABLE = (OperationalError, InterfaceError, PoolTimeoutError)
"""Database errors that mean that the database does not answer or is too busy."""
AWAY = "The database does not answer or cannot be written. The service continues as soon as it can; try again soon."
UNDONE = "Another change of the same data was made at the same time, and this one was undone. Try again."
RETRY_AFTER = 5
"""s, suggested to clients while the database does not answer."""
METHODS = ("DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT")
"""Methods that a path can support."""


def problem(status: int, detail: str, headers: Mapping[str, str] | None = None, **members: object) -> Response:
    """A problem document; `members` are its own extensions, such as `errors`."""
    document = {"type": "about:blank", "title": HTTPStatus(status).phrase, "status": status, "detail": detail}
    return Response(orjson.dumps(document | members), status, dict(headers or {}), PROBLEM)


def service_problem(request: Request, error: Exception) -> Response:
    """The problem document of a rejected request."""
    assert isinstance(error, ServiceError)
    detail = f"{error}{ROLE_TOO_LOW}" if isinstance(error, NotFoundError) and is_narrowed(request) else str(error)
    return problem(error.status, detail, error.headers)


def framework_problem(request: Request, error: Exception) -> Response:
    """The problem document of an unknown path or method."""
    assert isinstance(error, HTTPException)
    detail = DETAIL.get(error.status_code, str(error.detail))
    headers = dict(error.headers or {})
    if "Allow" in headers:
        headers["Allow"] = ", ".join(_allowed(request))
    return problem(error.status_code, detail, headers)


def _allowed(request: Request) -> list[str]:
    """Methods that the path supports on any route; the framework lists those of the first route only."""
    return [
        method
        for method in METHODS
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in request.app.routes)
    ]


def validation_problem(_: Request, error: Exception) -> Response:
    """The problem document of a malformed request, with each wrong parameter; 404 for a wrong path parameter."""
    assert isinstance(error, RequestValidationError)
    errors = [
        {"in": str(e["loc"][0]), "name": ".".join(map(str, e["loc"][1:])), "wanted": e["msg"]} for e in error.errors()
    ]
    first = errors[0]
    status = 404 if any(one["in"] == "path" for one in errors) else 422
    return problem(status, f"{first['in']} {first['name']}: {first['wanted']}", errors=errors)


def internal_problem(request: Request, _: Exception) -> Response:
    """The problem document of a bug: it reveals nothing, because the server logs the error with the request's
    identity."""
    identity = request.scope.get(IDENTITY)
    return problem(500, DETAIL[500], None if identity is None else {HEADER: identity})


def text_problem(_: Request, error: Exception) -> Response:
    """The problem document of a text that cannot be stored."""
    return problem(422, str(error))


def secret_key_problem(_: Request, error: Exception) -> Response:
    """The problem document of a secret that cannot be decrypted: the operator must set the right key."""
    return problem(503, str(error))


def database_problem(_: Request, error: Exception) -> Response:
    """The problem document while the database does not answer, is too busy, or undid a change: the client should try
    again. The log has the reason."""
    assert isinstance(error, SQLAlchemyError)
    log.warning("the database refused a request: %s", database_reason(error) or error)
    is_undone = isinstance(error, OperationalError) and undone(error) is not None
    return problem(503, UNDONE if is_undone else AWAY, {"Retry-After": str(RETRY_AFTER)})


def install(app: FastAPI) -> None:
    """Register a handler for every kind of error."""
    app.add_exception_handler(ServiceError, service_problem)
    app.add_exception_handler(HTTPException, framework_problem)
    app.add_exception_handler(RequestValidationError, validation_problem)
    for unreachable in UNREACHABLE:
        app.add_exception_handler(unreachable, database_problem)
    app.add_exception_handler(Exception, internal_problem)


def openapi_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The OpenAPI description of responses with these statuses."""
    content = {PROBLEM: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    return {status: {"description": HTTPStatus(status).phrase, "content": content} for status in statuses}
