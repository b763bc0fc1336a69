"""A fit, for an engineer at a terminal."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from core.workbench.fitting import FitResult
from core.workbench.tables import values_of, version_tables
from service.models.model_file import ModelFile
from service.models.workbench.summary import shown
from service.models.workbench.work import Work


def summary(found: Work[FitResult]) -> RenderableType:
    """Values, errors before and after, and what to know of them."""
    return Group(*_parts(found))


def values_table(model: ModelFile) -> Table:
    """Of every parameter."""
    table = Table("effect", "parameter")
    table.add_column("value", justify="right")
    table.add_column("standard deviation")
    table.add_column("unit")
    for one in values_of(model.isolator, model.standard_deviations):
        table.add_row(one.effect, one.parameter, one.value, one.std or "held", one.unit)
    return table


def _parts(found: Work[FitResult]) -> Iterator[RenderableType]:
    yield Text(f"{found.model.building}, direction {found.model.direction}\n", style="bold")
    yield values_table(found.model)
    for table in version_tables(found.result.versions, found.result.earthquakes):
        yield Text("")
        yield shown(table)
        yield Text(table.note, style="dim")
    yield Text("\n" + "\n".join(found.result.text))
    for reason in found.result.earthquakes.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
