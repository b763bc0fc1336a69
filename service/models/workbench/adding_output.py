"""An effect that was added, at a terminal and as JSON."""

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from core.workbench.improving import ExtensionResult
from core.workbench.tables import version_tables
from service.models.workbench.comparison_json import finite, model_as_json
from service.models.workbench.diagnosis_json import candidate_as_json, versions_as_json
from service.models.workbench.summary import shown, values_table
from service.models.workbench.work import Work
from service.version import VERSION


def summary(found: Work[ExtensionResult]) -> RenderableType:
    """The effect, its values, and the errors of every version."""
    return Group(*_parts(found))


def as_json(found: Work[ExtensionResult]) -> dict[str, Any]:
    """SI units, null for what is not known."""
    result = found.result
    return finite(
        {
            "version": VERSION,
            "building": found.given.building,
            "added": candidate_as_json(result.candidate, result.before),
            "versions": versions_as_json(result.versions, result.earthquakes),
            "model": model_as_json(found.model),
            "explanation": " ".join(result.text),
            "unused": list(result.earthquakes.unused),
        }
    )


def _parts(found: Work[ExtensionResult]) -> Iterator[RenderableType]:
    yield Text("\n".join(found.result.text) + "\n")
    for table in version_tables(found.result.versions, found.result.earthquakes):
        yield shown(table)
        yield Text(f"{table.note}\n", style="dim")
    yield values_table(found.model)
    for reason in found.result.earthquakes.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
