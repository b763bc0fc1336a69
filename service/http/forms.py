"""Forms of pages: read, checked, and shown again with the typed values and the problems."""

import re
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from email.message import Message
from email.parser import BytesParser
from email.policy import compat32
from typing import Any, Generic, TypeVar
from urllib.parse import parse_qs

from fastapi import Request, Response
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from starlette.concurrency import run_in_threadpool

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


@dataclass(frozen=True, slots=True)
class SentFile:
    """A file of a form."""

    name: str
    """As the browser sends it, without a folder."""
    data: bytes


@dataclass(frozen=True, slots=True)
class PostedFiles(Generic[Wanted]):
    """A form with files."""

    form: Posted[Wanted]
    files: tuple[SentFile, ...]
    """Files that were chosen."""


def posted_with_files(model: type[Wanted], most: int) -> Callable[[Request], Coroutine[Any, Any, PostedFiles[Wanted]]]:
    """A dependency that reads the form of a page, with the files that were chosen; arguments as of `posted`."""

    async def read(request: Request) -> PostedFiles[Wanted]:
        kind = request.headers.get("content-type", "")
        if not kind.lower().startswith("multipart/form-data"):
            return PostedFiles(Posted(model, fields_of(await read_body(request, MOST))), ())
        body = await read_bytes(request, most)
        fields, files = await run_in_threadpool(parts, kind, body)
        return PostedFiles(Posted(model, fields), files)

    return read


def parts(kind: str, body: bytes) -> tuple[dict[str, str], tuple[SentFile, ...]]:
    """Fields of a form with files, each once, and the files; bytes stay as they are.

    Args:
        kind: its media type, with the boundary.
        body: as it was sent.
    """
    message = BytesParser(policy=compat32).parsebytes(b"Content-Type: " + kind.encode("latin-1") + b"\r\n\r\n" + body)
    fields, files = dict[str, str](), list[SentFile]()
    found = message.get_payload()
    for part in found if isinstance(found, list) else ():
        data = part.get_payload(decode=True) if isinstance(part, Message) else None
        if not isinstance(part, Message) or not isinstance(data, bytes):
            continue  # parts within a part are none of a form
        about = _disposition(part)
        filename = about.get_filename()
        if filename is None:
            fields[str(about.get_param("name", "", "content-disposition"))] = data.decode("utf-8", "replace").strip()
        elif filename and data:
            files.append(SentFile(re.split(r"[/\\]", filename)[-1], data))
    return fields, tuple(files)


def _disposition(part: Message) -> Message:
    """The header that names a part; browsers write names in UTF-8."""
    raw = next((value for name, value in part.raw_items() if name.lower() == "content-disposition"), "")
    about = Message()
    about["Content-Disposition"] = str(raw).encode("ascii", "surrogateescape").decode("utf-8", "replace")
    return about


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

    Raises:
        TooLargeError: it is longer than `most` bytes; the rest of it is not read.
    """
    return (await read_bytes(request, most)).decode("utf-8", "replace")


async def read_bytes(request: Request, most: int) -> bytes:
    """The posted bytes.

    Raises:
        TooLargeError: there are more than `most`; the rest is not read.
    """
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > most:
            raise TooLargeError(f"The posted text is longer than {most} bytes; send several shorter ones.")
    return bytes(body)
