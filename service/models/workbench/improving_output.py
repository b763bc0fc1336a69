"""A model made better, at a terminal and as JSON."""

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from core.workbench.improving import ImprovementResult
from core.workbench.tables import version_tables
from service.models.workbench.comparison_json import finite, model_as_json
from service.models.workbench.diagnosis_json import as_json as diagnosis_as_json, versions_as_json
from service.models.workbench.summary import shown, values_table
from service.models.workbench.work import Work, diagnosis
from service.version import VERSION


def summary(found: Work[ImprovementResult]) -> RenderableType:
    """Added effects, and the errors of every version."""
    return Group(*_parts(found))


def as_json(found: Work[ImprovementResult]) -> dict[str, Any]:
    """SI units, null for what is not known."""
    result = found.result
    return finite(
        {
            "version": VERSION,
            "building": found.model.building,
            "taken": list(result.added),
            "versions": versions_as_json(result.versions, result.earthquakes),
            "model": model_as_json(found.model),
            "diagnoses": [
                diagnosis_as_json(diagnosis(one, found.given, found.model.parent or "")) for one in result.rounds
            ],
            "explanation": " ".join(result.text),
        }
    )


def _parts(found: Work[ImprovementResult]) -> Iterator[RenderableType]:
    yield Text("\n".join(found.result.text) + "\n")
    for table in version_tables(found.result.versions, found.result.earthquakes):
        yield shown(table)
        yield Text(f"{table.note}\n", style="dim")
    yield values_table(found.model)
    for reason in found.result.earthquakes.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
