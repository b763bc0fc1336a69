"""Reports as text: tables, and sentences in lines of equal length."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

WIDTH = 100
"""Characters of a line of sentences."""


@dataclass(frozen=True, slots=True)
class Table:
    """Cells as text; the first column names the rows, the others are numbers unless listed in `texts`."""

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    sums: int = 0
    """Number of rows at the end that are over several earthquakes."""
    texts: tuple[str, ...] = ()
    """Headings of columns of text, besides the first."""

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        widths = [max(map(len, column)) for column in zip(self.headings, *self.rows, strict=True)]
        is_text = [not number or heading in self.texts for number, heading in enumerate(self.headings)]

        def line(cells: Sequence[str]) -> str:
            each = zip(cells, widths, is_text, strict=True)
            return "  ".join(c.ljust(w) if text else c.rjust(w) for c, w, text in each).rstrip()

        yield self.caption
        yield f"  {line(self.headings)}"
        yield f"  {'  '.join('-' * width for width in widths)}"
        yield from (f"  {line(row)}" for row in self.rows)
        yield from textwrap.wrap(self.note, WIDTH, initial_indent="  ", subsequent_indent="  ")


def report(title: str, *parts: "Table | Sequence[str] | None") -> str:
    """A title, tables and sentences, as a result prints them.

    Args:
        title: first line.
        parts: tables, or sentences that make one paragraph; empty ones and None are left out.
    """
    written = [
        str(part) if isinstance(part, Table) else "\n".join(textwrap.fill(sentence, WIDTH) for sentence in part)
        for part in parts
        if part
    ]
    return "\n\n".join([f"{title}\n{'=' * min(len(title), WIDTH)}", *written])
