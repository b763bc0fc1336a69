"""A model held against records, for an engineer at a terminal."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from core.tables import Table as ErrorsTable
from core.workbench.comparing import ComparisonResult, force_table, outer_levels, prediction_table
from service.models.workbench.work import Work


def summary(found: Work[ComparisonResult]) -> RenderableType:
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


def _parts(found: Work[ComparisonResult]) -> Iterator[RenderableType]:
    effects = ", ".join(found.model.isolator.effects)
    yield Text(f"{found.model.building}, direction {found.model.direction}: {effects}\n", style="bold")
    result = found.result
    for table in (force_table(result), prediction_table(result, outer_levels(result))):
        if table is not None:
            yield shown(table)
            yield Text(f"{table.note}\n", style="dim")
    yield Text("\n".join(result.text))
    for remark in (*result.errors.remarks, *(f"not used: {one}" for one in result.earthquakes.unused)):
        yield Text(f"\n{remark}", style="dim")
