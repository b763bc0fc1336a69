"""Errors as HTTP: every one of them is a problem document (RFC 9457)."""

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import orjson
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import InterfaceError, OperationalError, TimeoutError as PoolTimeoutError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from service.errors import ServiceError

PROBLEM = "application/problem+json"
DETAIL = {
    404: "Nothing is served at this path; /docs lists what is.",
    405: "This path does not answer that method; the header Allow lists those it does.",
    500: "An error of ours; the log of the service has it.",
}
UNREACHABLE = (OperationalError, InterfaceError, PoolTimeoutError)
"""Errors that say that the database is away, or too busy."""
AWAY = "The database does not answer; the service goes on by itself once it does, so asking again soon would do."
RETRY_AFTER = 5
"""s."""
METHODS = ("DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT")
"""That a path may answer."""


def problem(status: int, detail: str, headers: Mapping[str, str] | None = None, **members: object) -> Response:
    """One problem document; `members` are its own extensions, such as `errors`."""
    document = {"type": "about:blank", "title": HTTPStatus(status).phrase, "status": status, "detail": detail}
    return Response(orjson.dumps(document | members), status, dict(headers or {}), PROBLEM)


def of_service(_: Request, error: Exception) -> Response:
    """A refusal of ours."""
    assert isinstance(error, ServiceError)
    return problem(error.status, str(error), error.headers)


def of_framework(request: Request, error: Exception) -> Response:
    """No such path, or not with that method."""
    assert isinstance(error, HTTPException)
    detail = DETAIL.get(error.status_code, str(error.detail))
    headers = dict(error.headers or {})
    if "Allow" in headers:
        headers["Allow"] = ", ".join(_allowed(request))
    return problem(error.status_code, detail, headers)


def _allowed(request: Request) -> list[str]:
    """Methods that the request's path answers, by all its routes; the framework names those of the first only."""
    return [
        method
        for method in METHODS
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in request.app.routes)
    ]


def of_request(_: Request, error: Exception) -> Response:
    """A malformed request: which parameter, and what is wanted of it. At a path that cannot be, nothing is: 404."""
    assert isinstance(error, RequestValidationError)
    errors = [
        {"in": str(e["loc"][0]), "name": ".".join(map(str, e["loc"][1:])), "wanted": e["msg"]} for e in error.errors()
    ]
    first = errors[0]
    status = 404 if any(one["in"] == "path" for one in errors) else 422
    return problem(status, f"{first['in']} {first['name']}: {first['wanted']}", errors=errors)


def of_ours(_: Request, __: Exception) -> Response:
    """A bug: it says nothing of itself to the outside and is logged by the server."""
    return problem(500, DETAIL[500])


def of_text(_: Request, error: Exception) -> Response:
    """A text that cannot be stored."""
    return problem(422, str(error))


def of_secret_key(_: Request, error: Exception) -> Response:
    """A secret that cannot be decrypted: the operator has to set the right key."""
    return problem(503, str(error))


def of_database(_: Request, __: Exception) -> Response:
    """The database is away, or too busy: it is worth asking again."""
    return problem(503, AWAY, {"Retry-After": str(RETRY_AFTER)})


def install(app: FastAPI) -> None:
    """Give every error its status and its document."""
    app.add_exception_handler(ServiceError, of_service)
    app.add_exception_handler(HTTPException, of_framework)
    app.add_exception_handler(RequestValidationError, of_request)
    for unreachable in UNREACHABLE:
        app.add_exception_handler(unreachable, of_database)
    app.add_exception_handler(Exception, of_ours)


def documented(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """What the OpenAPI document says of these statuses."""
    content = {PROBLEM: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    return {status: {"description": HTTPStatus(status).phrase, "content": content} for status in statuses}
