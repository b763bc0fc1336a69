"""A model held against records, for an engineer at a terminal."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from service.models.workbench.errors_table import ErrorsTable, force_errors, levels_of, predicted_errors
from service.models.workbench.held import Held


def summary(found: Held) -> RenderableType:
    """Errors by earthquake and over all, then where the model fails."""
    return Group(*_parts(found))


def shown(table: ErrorsTable) -> Table:
    """A table of errors at a terminal."""
    drawn = Table(title=table.caption, title_justify="left", title_style="bold")
    for number, heading in enumerate(table.headings):
        is_text = not number or heading in table.texts
        drawn.add_column(heading, justify="left" if is_text else "right", no_wrap=not number)
    for number, row in enumerate(table.rows, start=1):
        drawn.add_row(*row, end_section=number == len(table.rows) - table.sums)
    return drawn


def _parts(found: Held) -> Iterator[RenderableType]:
    effects = ", ".join(found.model.isolator.effects)
    yield Text(f"{found.model.building}, direction {found.model.direction}: {effects}\n", style="bold")
    levels = levels_of(found)
    for table in (force_errors(found), predicted_errors(found, dict.fromkeys([*levels[:1], *levels[-1:]]))):
        if table is not None:
            yield shown(table)
            yield Text(f"{table.note}\n", style="dim")
    yield Text("\n".join(found.text))
    for remark in (*found.answers.remarks, *(f"not used: {one}" for one in found.records.unused)):
        yield Text(f"\n{remark}", style="dim")
