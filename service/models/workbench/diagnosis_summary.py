"""A diagnosis, for an engineer at a terminal."""

from collections.abc import Iterator
from dataclasses import replace

from rich.console import Group, RenderableType
from rich.text import Text

from core.tables import Table
from core.workbench.diagnosing import BRIEF, DiagnosisResult, candidate_table
from core.workbench.tables import version_tables
from service.models.workbench.fit_summary import values_table
from service.models.workbench.summary import shown
from service.models.workbench.work import Work


def summary(found: Work[DiagnosisResult]) -> RenderableType:
    """What is missing, what was tried, and the errors of every version."""
    return Group(*_parts(found))


def _brief(table: Table) -> Table:
    """Without the remarks, for which a terminal is too narrow; the text has those that matter."""
    return replace(table, headings=table.headings[:-1], rows=tuple(row[:-1] for row in table.rows))


def _parts(found: Work[DiagnosisResult]) -> Iterator[RenderableType]:
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
