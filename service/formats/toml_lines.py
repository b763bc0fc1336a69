"""Which line of a TOML text holds a key, so that an error can name it."""

import tomllib
from bisect import bisect_left
from typing import Any

Path = tuple[str | int, ...]
"""Keys and positions from the document down, as in `("level", 3, "mass")`."""


def line_of(text: str, path: Path) -> int:
    """The line, counted from 1, where the key at `path` begins, or the nearest table around it that exists.

    TOML parsers keep no positions. But a text cut after a line holds exactly the keys begun so far, so the line
    is the first at which the key is there.
    """
    lines = text.splitlines()
    while path and not _holds(tomllib.loads(text), path):
        path = path[:-1]
    if not path:
        return 1
    end = bisect_left(range(len(lines) + 1), True, key=lambda count: _holds(_beginning(lines, count), path))
    while end > 1 and _parsed(lines, end - 1) is None:  # a value of several lines begins above its end
        end -= 1
    return end


def _beginning(lines: list[str], count: int) -> dict[str, Any]:
    """The document made of the first `count` lines, without a value that they leave open."""
    while (document := _parsed(lines, count)) is None:
        count -= 1
    return document


def _parsed(lines: list[str], count: int) -> dict[str, Any] | None:
    try:
        return tomllib.loads("\n".join(lines[:count]))
    except tomllib.TOMLDecodeError:
        return None


def _holds(document: Any, path: Path) -> bool:  # noqa: ANN401  whatever TOML may hold
    for key in path:
        if isinstance(key, int):
            if not isinstance(document, list) or key >= len(document):
                return False
        elif not isinstance(document, dict) or key not in document:
            return False
        document = document[key]
    return True
