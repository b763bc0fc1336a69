"""Content of a report, the same for terminal, HTML file and Markdown: text, tables and figures in order."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal

from core.rounding import plain
from core.tables import Table

if TYPE_CHECKING:  # it takes long to import, and only who draws needs it
    import altair as alt

Rows = list[dict[str, Any]]
LONGEST = 400
"""Rows of a figure's table: of a longer one every second, third ... is shown."""


@dataclass(frozen=True, slots=True)
class Text:
    """Sentences of one kind."""

    sentences: tuple[str, ...]
    kind: Literal["heading", "paragraph", "remark", "note"]
    """A paragraph holds all sentences; each remark and each note is one of its own, and notes are in small print."""


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """The numbers of a figure, for readers who do not see it or need the values."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    is_thinned: bool


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """Pictures with one caption."""

    key: str
    """A word for addresses and ids."""
    title: str
    caption: str
    """Contents, and signs to look for."""
    pictures: "tuple[alt.TopLevelMixin, ...]"
    numbers: Numbers | None = None


Part = Text | Table | Figure


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """A report; without a title on a terminal where the text names its subject."""

    title: str
    parts: tuple[Part, ...]


def heading(text: str) -> Text:
    """Heading of the parts that follow."""
    return Text((text,), "heading")


def paragraph(sentences: Iterable[str]) -> Text:
    """A paragraph."""
    return Text(tuple(sentences), "paragraph")


def remarks(sentences: Iterable[str]) -> Text:
    """A list of remarks."""
    return Text(tuple(sentences), "remark")


def notes(sentences: Iterable[str]) -> Text:
    """Remarks in small print."""
    return Text(tuple(sentences), "note")


def numbers(rows: Sequence[Mapping[str, Any]]) -> Numbers:
    """Rows of equal keys as a table, to four digits."""
    step = max(1, -(-len(rows) // LONGEST))
    columns = tuple(rows[0]) if rows else ()
    return Numbers(columns, tuple(tuple(_cell(row[c]) for c in columns) for row in rows[::step]), step > 1)


def _cell(value: object) -> str:
    return plain(value) if isinstance(value, float) and isfinite(value) else str(value)
