"""Forms of pages: read, checked, and shown again with the typed values and the problems."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, TypeVar
from urllib.parse import parse_qs

from fastapi import Depends, Request, Response
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


async def posted(request: Request) -> dict[str, str]:
    """The fields of a form, each once."""
    return {name: values[-1].strip() for name, values in parse_qs(await read_body(request, MOST)).items()}


Form = Annotated[dict[str, str], Depends(posted)]


def refused(name: str, form: Mapping[str, str], error: ServiceError) -> Refused:
    """A form to be shown again after an error."""
    problems = {of: _sentence(said) for of, said in error.problems.items()} if isinstance(error, FieldsError) else {}
    given = {of: value for of, value in form.items() if of not in SECRETS}
    return Refused(name, given, "" if problems else str(error), problems, error.status)


def taken(
    name: str, form: Mapping[str, str], act: Callable[[], Response], page: Callable[[Refused], Response]
) -> Response:
    """The response to a form.

    Args:
        name: the form's name on its page.
        form: the typed values.
        act: carries out the request.
        page: the page that the form is on; it is shown again if the form is refused.
    """
    try:
        return act()
    except (ConflictError, TooManyRequestsError) as error:
        return page(refused(name, form, error))


def checked(model: type[Wanted], given: Mapping[str, object], others: Mapping[str, str | None] | None = None) -> Wanted:
    """The fields of a form as a model, without empty ones.

    Args:
        model: the model.
        given: the typed values.
        others: problems of fields outside the model; None: no problems.

    Raises:
        FieldsError: some fields do not fit.
    """
    others = others or {}
    problems = {name: problem for name, problem in others.items() if problem}
    try:
        made = model.model_validate({name: value for name, value in given.items() if value and name not in others})
    except ValidationError as error:
        wrong = error.errors(include_input=False, include_url=False)
        raise FieldsError({str(one["loc"][0]): _in_words(one) for one in wrong} | problems) from None
    if problems:
        raise FieldsError(problems)
    return made


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
        case "literal_error":
            return f"choose {about['expected']}"
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
