"""What the service refuses; `service.http.problems` answers with it.

ServiceError
├── NotFoundError       404, nothing by that name
├── ConflictError       409, well formed, but it does not fit what it is asked of
│   └── FieldsError     the same, by the names of the fields
├── TooLargeError       413, more than is taken or given at once
├── UnauthorizedError   401, a key is missing or not known
├── LoginWantedError    303, a page that wants a key: the form comes next
├── ForbiddenError      403, known, but not allowed
└── TooManyRequestsError  429, more than one client may have under way
"""

from collections.abc import Mapping


class ServiceError(Exception):
    """What the service can refuse to do; the message says what was found and what would do."""

    status: int
    headers: Mapping[str, str] = {}


class NotFoundError(ServiceError):
    """Nothing by that name."""

    status = 404

    def __init__(self, what: str, name: object) -> None:
        super().__init__(f"There is no {what} {str(name)!r}.")


class ConflictError(ServiceError):
    """Well formed, but it does not fit what it is asked of."""

    status = 409


class FieldsError(ConflictError):
    """Some fields of what was given do not fit; `problems` has by their names what is wrong."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        super().__init__(f"{'; '.join(f'{name}: {problem}' for name, problem in problems.items())}.")
        self.problems = problems


class UnauthorizedError(ServiceError):
    """A key is missing or not known."""

    status = 401
    headers = {"WWW-Authenticate": 'Bearer realm="menshin"'}  # noqa: RUF012  read only


class TooLargeError(ServiceError):
    """More than is taken or given at once."""

    status = 413


class LoginWantedError(ServiceError):
    """A page that wants a key, asked for by a browser that has none."""

    status = 303

    def __init__(self, form: str) -> None:
        super().__init__("This page takes a key; the form at Location asks for it.")
        self.headers = {"Location": form}


class ForbiddenError(ServiceError):
    """Known, but not allowed."""

    status = 403


class TooManyRequestsError(ServiceError):
    """More than one client may have under way."""

    status = 429
    headers = {"Retry-After": "60"}  # noqa: RUF012  read only
