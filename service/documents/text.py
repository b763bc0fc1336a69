"""Reports and tables as text: at a terminal, and as Markdown. Figures are for HTML files."""

from collections.abc import Iterable, Iterator, Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text as RichText

from core.tables import Table
from service.documents.document import Document, Figure, Part, Text

NARROW = 40
"""Characters up to which the names of rows stay on one line."""
STYLES = {"heading": "bold", "note": "dim"}
STATE_STYLES = {
    "good": "green",
    **dict.fromkeys(("note", "warning", "undecided"), "yellow"),
    **dict.fromkeys(("wrong", "fatal", "exceeded"), "bold red"),
    "unknown": "magenta",
}
"""By the word that is all of a cell and states how something is."""


def printed(document: Document) -> RenderableType:
    """Text and tables at a terminal, a blank line between two."""
    blocks = [block for part in document.parts for block in _blocks(part)]
    if document.title:
        blocks.insert(0, [RichText(document.title, style="bold")])
    return Group(*(one for number, block in enumerate(blocks) for one in ([RichText("")] * bool(number) + block)))


def markdown(document: Document) -> str:
    """Text and tables as Markdown."""
    blocks = [f"# {document.title}", *(block for part in document.parts for block in _markdown(part))]
    return "\n\n".join(blocks) + "\n"


def print_table(headings: Sequence[str], rows: Iterable[Sequence[str]], title: str = "") -> None:
    """Print a table of texts.

    Args:
        headings: of the columns.
        rows: as many cells each.
        title: above the table.
    """
    Console().print(table(Table(title, tuple(headings), tuple(map(tuple, rows)), texts=tuple(headings))))


def table(content: Table) -> RichTable:
    """A table without its note, every cell in full: words longer than their column are folded. Sums stand apart.

    A cell is no markup: square brackets are printed as they are.
    """
    drawn = RichTable(title=content.caption or None, title_justify="left", title_style="bold")
    for number, title in enumerate(content.headings):
        is_text = not number or title in content.texts
        is_narrow = not number and max((len(row[0]) for row in content.rows), default=0) <= NARROW
        drawn.add_column(RichText(title), justify="left" if is_text else "right", no_wrap=is_narrow, overflow="fold")
    for number, row in enumerate(content.rows, start=1):
        cells = (RichText(cell, style=STATE_STYLES.get(cell, "")) for cell in row)
        drawn.add_row(*cells, end_section=number == len(content.rows) - content.sums)
    return drawn


def _blocks(part: Part) -> Iterator[list[RenderableType]]:
    match part:
        case Table():
            yield [table(part), *([RichText(part.note, style="dim")] if part.note else [])]
        case Text(sentences, "paragraph"):
            yield [RichText("\n".join(sentences))]
        case Text(sentences, kind):
            for sentence in sentences:
                yield [RichText(sentence, style=STYLES.get(kind, ""))]
        case Figure():
            pass


def _markdown(part: Part) -> Iterator[str]:
    match part:
        case Table():
            yield f"### {part.caption}"
            yield _rows(part)
            if part.note:
                yield part.note
        case Text(sentences, "heading"):
            yield f"## {sentences[0]}"
        case Text(sentences, "paragraph"):
            yield "\n".join(sentences)
        case Text(sentences):
            if sentences:
                yield "\n".join(f"- {sentence}" for sentence in sentences)
        case Figure():
            pass


def _rows(table: Table) -> str:
    is_text = [not number or title in table.texts for number, title in enumerate(table.headings)]
    rule = ["---" if text else "---:" for text in is_text]
    return "\n".join(f"| {' | '.join(row)} |" for row in (table.headings, rule, *table.rows))
