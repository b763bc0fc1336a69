"""Tables on a terminal, with every cell in full: words longer than their column are folded, not cut off."""

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text


def folding_table(*headings: str, title: str | None = None) -> Table:
    """A table of these columns, without rows."""
    table = Table(title=title, title_justify="left")
    for heading in headings:
        table.add_column(heading, overflow="fold")
    return table


def print_table(headings: Sequence[str], rows: Iterable[Sequence[str | Text]], title: str | None = None) -> None:
    """Print a table whose cells are not markup: square brackets are printed as they are.

    Args:
        headings: of the columns.
        rows: as many cells each; a Text keeps its style.
        title: above the table.
    """
    table = folding_table(*headings, title=title)
    for row in rows:
        table.add_row(*row)
    Console(markup=False, highlight=False).print(table)
