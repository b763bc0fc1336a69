"""An effect that was added, at a terminal and as JSON."""

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from service.models.workbench.adding import Added
from service.models.workbench.adding_words import words
from service.models.workbench.comparison_json import finite, model_as_json
from service.models.workbench.diagnosis_json import candidate_as_json, versions_as_json
from service.models.workbench.fit_summary import values_table
from service.models.workbench.summary import shown
from service.models.workbench.versions import tables
from service.version import VERSION


def summary(found: Added) -> RenderableType:
    """What it does, its values, and the errors of every version."""
    return Group(*_parts(found))


def as_json(found: Added) -> dict[str, Any]:
    """SI units, null for what is not known."""
    before = found.versions[1].error([one.name for one in found.records.fitted])
    return finite(
        {
            "version": VERSION,
            "building": found.given.building,
            "added": candidate_as_json(found.candidate, before),
            "versions": versions_as_json(found.versions, found.records),
            "model": model_as_json(found.model),
            "explanation": " ".join(words(found)),
            "unused": list(found.records.unused),
        }
    )


def _parts(found: Added) -> Iterator[RenderableType]:
    yield Text("\n".join(words(found)) + "\n")
    for table in tables(found.versions, found.records):
        yield shown(table)
        yield Text(f"{table.note}\n", style="dim")
    yield values_table(found.model)
    for reason in found.records.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
