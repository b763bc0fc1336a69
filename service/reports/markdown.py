"""Reports as Markdown."""

from collections.abc import Iterator

from core.tables import Table
from service.reports.document import Document, Figure, Part, Text


def markdown(document: Document) -> str:
    """Text and tables; figures are for HTML."""
    blocks = [f"# {document.title}", *(block for part in document.parts for block in _blocks(part))]
    return "\n\n".join(blocks) + "\n"


def _blocks(part: Part) -> Iterator[str]:
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
