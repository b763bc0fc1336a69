"""Errors that the service raises for invalid requests; `service.http.problems` turns them into responses.

ServiceError
├── NotFoundError         404, the named object does not exist
├── ConflictError         409, the request conflicts with the current state
│   └── FieldsError       409, with a problem for each invalid field
├── TooLargeError         413, the request or its response exceeds a limit
├── UnauthorizedError     401, the key is missing or unknown
├── LoginRequiredError    303, redirects a browser to the login form
├── ForbiddenError        403, the caller's role does not permit the request
├── TooManyRequestsError  429, the client has too many requests in progress
└── StoreAwayError        503, the store of original files cannot be used now
"""

from collections.abc import Mapping


class ServiceError(Exception):
    """A request that the service rejects; the message states the problem and its remedy."""

    status: int
    headers: Mapping[str, str] = {}


class NotFoundError(ServiceError):
    """The named object does not exist."""

    status = 404

    def __init__(self, what: str, name: object, pruned_by: str | None = None) -> None:
        """`pruned_by` is the setting by which old objects of that kind are deleted."""
        message = f"There is no {what} {str(name)!r}."
        if pruned_by is not None:
            message += f" It may have been deleted: 'menshin prune' deletes old ones where {pruned_by} is set."
        super().__init__(message)


class ConflictError(ServiceError):
    """The request is well formed, but conflicts with the current state."""

    status = 409


class FieldsError(ConflictError):
    """Some fields are invalid; `problems` maps field names to their problems."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        super().__init__(f"{'; '.join(f'{name}: {problem}' for name, problem in problems.items())}.")
        self.problems = problems


class UnauthorizedError(ServiceError):
    """The API key is missing or unknown."""

    status = 401
    headers = {"WWW-Authenticate": 'Bearer realm="menshin"'}  # noqa: RUF012  read only


class TooLargeError(ServiceError):
    """The request or its response exceeds a limit."""

    status = 413


class LoginRequiredError(ServiceError):
    """The page needs a login: the browser is redirected to the login form."""

    status = 303

    def __init__(self, form: str) -> None:
        super().__init__("This page needs a login; the form is at Location.")
        self.headers = {"Location": form}


class ForbiddenError(ServiceError):
    """The caller's role does not permit the request."""

    status = 403


class TooManyRequestsError(ServiceError):
    """The client has too many requests in progress."""

    status = 429
    headers = {"Retry-After": "60"}  # noqa: RUF012  read only


class StoreAwayError(ServiceError):
    """The store of original files cannot be used now; nothing is lost, and everything continues once it can."""

    status = 503
    headers = {"Retry-After": "60"}  # noqa: RUF012  read only
