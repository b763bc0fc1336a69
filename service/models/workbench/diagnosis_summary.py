"""A diagnosis, for an engineer at a terminal."""

from collections.abc import Iterator
from dataclasses import replace

from rich.console import Group, RenderableType
from rich.text import Text

from service.models.workbench.candidates_table import candidates_table
from service.models.workbench.diagnosing import Diagnosed
from service.models.workbench.diagnosis_words import words
from service.models.workbench.errors_table import ErrorsTable
from service.models.workbench.fit_summary import values_table
from service.models.workbench.summary import shown
from service.models.workbench.versions import tables

SHOWN = 8
"""Candidates at a terminal, the best; the page and the JSON have all."""


def summary(found: Diagnosed) -> RenderableType:
    """What is missing, what was tried, and the errors of every version."""
    return Group(*_parts(found))


def _brief(table: ErrorsTable) -> ErrorsTable:
    """Without the remarks, for which a terminal is too narrow; the text has those that matter."""
    return replace(table, headings=table.headings[:-1], rows=tuple(row[:-1] for row in table.rows))


def _parts(found: Diagnosed) -> Iterator[RenderableType]:
    effects = ", ".join(found.given.isolator.effects)
    yield Text(f"{found.given.building}, direction {found.given.direction}: {effects}\n", style="bold")
    yield Text("\n".join(words(found)) + "\n")
    versions = (*found.versions[:2], *found.versions[2:][-1:])
    for table in (_brief(candidates_table(found, found.candidates[:SHOWN])), *tables(versions, found.records)):
        yield shown(table)
        yield Text(f"{table.note}\n", style="dim")
    if found.diagnosis.steps:
        yield values_table(found.model)
    for reason in found.records.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
