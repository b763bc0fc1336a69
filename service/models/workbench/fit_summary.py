"""A fit, for an engineer at a terminal."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from service.models.model_file import ModelFile
from service.models.workbench.fit_words import words
from service.models.workbench.refit import Refit
from service.models.workbench.summary import shown
from service.models.workbench.values import values_of
from service.models.workbench.versions import gain, tables


def summary(found: Refit) -> RenderableType:
    """Values, errors before and after, and what to know of them."""
    return Group(*_parts(found))


def values_table(model: ModelFile) -> Table:
    """Of every parameter."""
    table = Table("effect", "parameter")
    table.add_column("value", justify="right")
    table.add_column("standard deviation")
    table.add_column("unit")
    for one in values_of(model):
        table.add_row(one.effect, one.parameter, one.value, one.std or "held", one.unit)
    return table


def _parts(found: Refit) -> Iterator[RenderableType]:
    yield Text(f"{found.model.building}, direction {found.model.direction}\n", style="bold")
    yield values_table(found.model)
    for table in tables(found.versions, found.records):
        yield Text("")
        yield shown(table)
        yield Text(table.note, style="dim")
    before, after = found.versions
    said = (*words(found.fit, found.inflation), *gain(before, after, found.records))
    yield Text("\n" + "\n".join(said))
    for reason in found.records.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
