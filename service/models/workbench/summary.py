"""Results of the workbench as text for a terminal."""

from collections.abc import Iterator
from dataclasses import replace

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from core.tables import Table as ErrorsTable
from core.workbench.comparing import ComparisonResult, force_table, outer_levels, prediction_table
from core.workbench.diagnosing import BRIEF, DiagnosisResult, candidate_table
from core.workbench.fitting import FitResult
from core.workbench.tables import values_of, version_tables
from service.models.model_file import ModelFile
from service.models.workbench.work import Work


def comparison_summary(found: Work[ComparisonResult]) -> RenderableType:
    """Errors by earthquake and over all, then where the model fails."""
    return Group(*_comparison_parts(found))


def shown(table: ErrorsTable) -> Table:
    """A table of errors at a terminal."""
    drawn = Table(title=table.caption, title_justify="left", title_style="bold")
    for number, heading in enumerate(table.headings):
        is_text = not number or heading in table.texts
        drawn.add_column(heading, justify="left" if is_text else "right", no_wrap=not number)
    for number, row in enumerate(table.rows, start=1):
        drawn.add_row(*row, end_section=number == len(table.rows) - table.sums)
    return drawn


def _comparison_parts(found: Work[ComparisonResult]) -> Iterator[RenderableType]:
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


def fit_summary(found: Work[FitResult]) -> RenderableType:
    """Values, errors before and after, and remarks."""
    return Group(*_fit_parts(found))


def values_table(model: ModelFile) -> Table:
    """Values of every parameter."""
    table = Table("effect", "parameter")
    table.add_column("value", justify="right")
    table.add_column("standard deviation")
    table.add_column("unit")
    for one in values_of(model.isolator, model.standard_deviations):
        table.add_row(one.effect, one.parameter, one.value, one.std or "held", one.unit)
    return table


def _fit_parts(found: Work[FitResult]) -> Iterator[RenderableType]:
    yield Text(f"{found.model.building}, direction {found.model.direction}\n", style="bold")
    yield values_table(found.model)
    for table in version_tables(found.result.versions, found.result.earthquakes):
        yield Text("")
        yield shown(table)
        yield Text(table.note, style="dim")
    yield Text("\n" + "\n".join(found.result.text))
    for reason in found.result.earthquakes.unused:
        yield Text(f"\nnot used: {reason}", style="dim")


def diagnosis_summary(found: Work[DiagnosisResult]) -> RenderableType:
    """Missing effects, effects tried, and the errors of every version."""
    return Group(*_diagnosis_parts(found))


def _brief(table: ErrorsTable) -> ErrorsTable:
    """Without the remarks, for which a terminal is too narrow; the text has those that matter."""
    return replace(table, headings=table.headings[:-1], rows=tuple(row[:-1] for row in table.rows))


def _diagnosis_parts(found: Work[DiagnosisResult]) -> Iterator[RenderableType]:
    result = found.result
    effects = ", ".join(found.given.isolator.effects)
    yield Text(f"{found.given.building}, direction {found.given.direction}: {effects}\n", style="bold")
    yield Text("\n".join(result.text) + "\n")
    versions = (*result.versions[:2], *result.versions[2:][-1:])
    for table in (
        _brief(candidate_table(result, result.candidates[:BRIEF])),
        *version_tables(versions, result.earthquakes),
    ):
        yield shown(table)
        yield Text(f"{table.note}\n", style="dim")
    if result.diagnosis.steps:
        yield values_table(found.model)
    for reason in result.earthquakes.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
