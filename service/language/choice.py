"""The language in which something is shown: English, or one that has catalogues."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

Language = Literal["en", "ja"]
ENGLISH: Language = "en"
LANGUAGES: Mapping[Language, str] = {"en": "English", "ja": "日本語"}
"""Each language's name in that language."""
_spoken: ContextVar[Language] = ContextVar("language", default=ENGLISH)


def spoken() -> Language:
    """The language of what is being shown; English unless `speaking` says otherwise."""
    return _spoken.get()


@contextmanager
def speaking(language: Language) -> Iterator[None]:
    """Show in this language until the end of the block, in this thread or task."""
    before = _spoken.set(language)
    try:
        yield
    finally:
        _spoken.reset(before)


def known(code: str | None) -> Language | None:
    """The language of a code such as `ja` or `ja-JP`; None if it has no catalogue."""
    primary = (code or "").strip().lower().partition("-")[0]
    return next((one for one in LANGUAGES if one == primary), None)


def accepted(header: str) -> Language:
    """The language that the header Accept-Language prefers among those there are; English if it names none.

    Source: RFC 9110, section 12.5.4.
    """
    weighted = []
    for place, part in enumerate(header.split(",")[:50]):
        code, _, parameters = part.partition(";")
        language = known(code)
        try:
            weight = float(parameters.strip().removeprefix("q=") or 1)
        except ValueError:
            continue
        if language is not None and weight > 0:
            weighted.append((-weight, place, language))
    return min(weighted)[2] if weighted else ENGLISH
