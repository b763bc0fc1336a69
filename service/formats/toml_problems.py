"""Checks of TOML documents that report every problem at once, each with its line and its key."""

import tomllib
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

Path = tuple[str | int, ...]
"""Keys and positions from the document down, as in `("level", 3, "mass")`."""
Problem = tuple[Path, str]
"""A path, and what is wrong there."""
Check = Callable[[Mapping[str, Any]], Iterator[Problem]]


class TomlError(Exception):
    """All that is wrong with a file, one problem a line, each with its line and key."""

    def __init__(self, problems: tuple[str, ...]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


class Table(BaseModel):
    """A table of a file: other keys than its fields are errors, and so is a text in place of a number."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


def checked(text: str, checks: Sequence[Check]) -> dict[str, Any]:
    """A document without problems.

    Args:
        text: TOML.
        checks: functions that yield the problems of a document.

    Raises:
        TomlError: there are problems; the message lists every one, in the order of the text.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise TomlError((f"this is not TOML: {error}",)) from None
    problems = [problem for check in checks for problem in check(document)]
    if problems:
        placed = sorted((line_of(text, path), number, path) for number, (path, _) in enumerate(problems))
        raise TomlError(tuple(f"line {line}: {_spelled(path)}{problems[number][1]}" for line, number, path in placed))
    return document


def wrong_keys(document: Mapping[str, Any], table: type[BaseModel]) -> Iterator[Problem]:
    """Keys that are unknown, missing or of a wrong kind."""
    try:
        table.model_validate(document)
    except ValidationError as error:
        for detail in error.errors():
            yield detail["loc"], _wanted(detail, table)


def unknown(key: str, known: Sequence[str]) -> str:
    """Message for an unknown key."""
    near = get_close_matches(key, known, n=1)
    return f"no such key; did you mean {near[0]!r}?" if near else f"no such key; known here: {', '.join(known)}"


def _spelled(path: Path) -> str:
    """`level[3].mass`, counted from 1 as an engineer does."""
    parts = (f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path)
    return f"{''.join(parts).removeprefix('.')}: " if path else ""


def _wanted(detail: ErrorDetails, document: type[BaseModel]) -> str:
    """Message for a key: the problem, the value and the key's meaning."""
    path = detail["loc"]
    while isinstance(path[-1], int) and len(path) > 1 and path[-2] == "position":  # one of a key's numbers
        path = path[:-1]
    table, key = _table_of(path, document), path[-1]
    if detail["type"] == "extra_forbidden":
        return unknown(str(key), list(table.model_fields))
    field = table.model_fields.get(str(key))
    meaning = f" ({field.description})" if field is not None else ""
    if detail["type"] == "missing":
        return f"is missing{meaning}"
    wanted = detail["msg"].removeprefix("Value error, ")
    value = detail["input"]
    got = "a table" if isinstance(value, dict) else repr(value)  # a table may hold a secret
    return f"{wanted[:1].lower()}{wanted[1:]}, got {got}{meaning}"


def _table_of(path: Path, document: type[BaseModel]) -> type[BaseModel]:
    """The table that the last key of a path belongs to."""
    table = document
    for key in path[:-1]:
        if isinstance(key, str):
            table = next(_tables(table.model_fields[key].annotation), table)
    return table


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401  a type, however it is written
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _tables(argument)


def line_of(text: str, path: Path) -> int:
    """The line, counted from 1, where the key at `path` begins, or the nearest table around it that exists.

    TOML parsers keep no positions. But the text up to a line contains exactly the keys begun so far, so the line is
    the first at which the key is there.
    """
    lines = text.splitlines()
    while path and not _has(tomllib.loads(text), path):
        path = path[:-1]
    if not path:
        return 1
    end = bisect_left(range(len(lines) + 1), True, key=lambda count: _has(_beginning(lines, count), path))
    while end > 1 and _parsed_lines(lines, end - 1) is None:  # a value of several lines begins above its end
        end -= 1
    return end


def _beginning(lines: list[str], count: int) -> dict[str, Any]:
    """The document made of the first `count` lines, without an unfinished value."""
    while (document := _parsed_lines(lines, count)) is None:
        count -= 1
    return document


def _parsed_lines(lines: list[str], count: int) -> dict[str, Any] | None:
    try:
        return tomllib.loads("\n".join(lines[:count]))
    except tomllib.TOMLDecodeError:
        return None


def _has(document: Any, path: Path) -> bool:  # noqa: ANN401  any value of TOML
    for key in path:
        if isinstance(key, int):
            if not isinstance(document, list) or key >= len(document):
                return False
        elif not isinstance(document, dict) or key not in document:
            return False
        document = document[key]
    return True
