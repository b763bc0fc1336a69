"""Forms of pages: read, checked, and shown again with the typed values and the problems."""

from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar
from urllib.parse import parse_qs

from fastapi import Request, Response
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from service.errors import ConflictError, FieldsError, ServiceError, TooLargeError, TooManyRequestsError

Wanted = TypeVar("Wanted", bound=BaseModel)
MOST = 64 * 1024
"""Bytes of a posted form."""
SECRETS = frozenset({"key", "secret"})
"""Fields that are never shown again."""
EMPTY = "this must not be empty"
PATTERNS = {
    r"\S": EMPTY,
    r"^[^\x00]*\S[^\x00]*$": "this must say something, without the character NUL",
    r"^\S+$": "this must not contain spaces",
    r"^[!-~]+$": "this must not contain spaces or accented letters",
    r"^[^\x00-\x1f]+$": "this must be one line of text",
}
"""Problem for people, by the pattern that a text does not match."""


@dataclass(frozen=True, slots=True)
class Refused:
    """A refused form, to be shown again; empty for a page without one."""

    form: str = ""
    """Its name on the page."""
    given: Mapping[str, str] = field(default_factory=dict)
    """Typed values by field, without secrets."""
    words: str = ""
    """Reason of the refusal."""
    problems: Mapping[str, str] = field(default_factory=dict)
    """Problems by field; empty if no field is at fault."""
    status: int = 200

    def __bool__(self) -> bool:
        return bool(self.form)

    def of(self, form: str) -> "Refused":
        """The refusal to show in the page's form of that name."""
        return self if self.form == form else NOT_REFUSED

    def typed(self, name: str, otherwise: str = "") -> str:
        """The value of a field; `otherwise` when the form is shown for the first time."""
        return self.given.get(name, "") if self else otherwise


NOT_REFUSED = Refused()


@dataclass(frozen=True, slots=True)
class Posted(Generic[Wanted]):
    """A form as it was sent."""

    model: type[Wanted]
    """Model that validates the form."""
    fields: Mapping[str, str]
    """Fields as typed, each once."""

    def checked(self) -> Wanted:
        """The form as its model; empty fields are omitted.

        Raises:
            FieldsError: some fields do not fit.
        """
        try:
            return self.model.model_validate({name: value for name, value in self.fields.items() if value})
        except ValidationError as error:
            wrong = error.errors(include_input=False, include_url=False)
            raise FieldsError({str(one["loc"][0]): _in_words(one) for one in wrong}) from None


def posted(model: type[Wanted], most: int = MOST) -> Callable[[Request], Coroutine[Any, Any, Posted[Wanted]]]:
    """A dependency that reads the form of a page.

    FastAPI's own `Form()` refuses a form before the endpoint runs; here the endpoint shows it again as it was typed.

    Args:
        model: what the form has to be.
        most: bytes that are read.
    """

    async def read(request: Request) -> Posted[Wanted]:
        return Posted(model, fields_of(await read_body(request, most)))

    return read


def fields_of(body: str) -> dict[str, str]:
    """The fields of a posted form, each once, without spaces around them."""
    return {name: values[-1].strip() for name, values in parse_qs(body).items()}


def ticked(fields: Mapping[str, object], prefix: str) -> list[str]:
    """Values of the ticked boxes, whose names are a prefix and a value."""
    return [name.removeprefix(prefix) for name in fields if name.startswith(prefix)]


def refused(name: str, form: Mapping[str, str], error: ServiceError) -> Refused:
    """A form to be shown again after an error."""
    problems = {of: _sentence(said) for of, said in error.problems.items()} if isinstance(error, FieldsError) else {}
    given = {of: value for of, value in form.items() if of not in SECRETS}
    return Refused(name, given, "" if problems else str(error), problems, error.status)


def answered(
    name: str, form: Posted[Wanted], act: Callable[[Wanted], Response], page: Callable[[Refused], Response]
) -> Response:
    """The response to a form.

    Args:
        name: the form's name on its page.
        form: the form as it was sent.
        act: carries out the request.
        page: the page that the form is on; it is shown again if the form is refused.
    """
    try:
        return act(form.checked())
    except (ConflictError, TooManyRequestsError) as error:
        return page(refused(name, form.fields, error))


def _in_words(error: ErrorDetails) -> str:
    """The text of a validation error for people."""
    about = error.get("ctx", {})
    match error["type"]:
        case "missing" | "string_too_short":
            return EMPTY
        case "string_too_long":
            return f"this must not be longer than {about['max_length']} characters"
        case "string_pattern_mismatch":
            return PATTERNS.get(about["pattern"], "this is not in the form that is needed")
        case "greater_than_equal":
            return f"this must be at least {about['ge']}"
        case "less_than_equal":
            return f"this must be at most {about['le']}"
        case "literal_error":
            return f"choose {about['expected']}"
        case "value_error":
            return str(about["error"])
        case "extra_forbidden":
            return "there is no such field"
    return "this is not in the form that is needed"


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:].rstrip('.')}."


async def read_body(request: Request, most: int) -> str:
    """The posted text; bytes that are not UTF-8 are replaced.

    Raises
    ------
    TooLargeError
        It is longer than `most` bytes; the rest of it is not read.
    """
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > most:
            raise TooLargeError(f"The posted text is longer than {most} bytes; send several shorter ones.")
    return body.decode("utf-8", "replace")
