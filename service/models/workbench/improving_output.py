"""A model made better, at a terminal and as JSON."""

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from core.effects import EFFECTS
from service.models.workbench.comparison_json import finite, model_as_json
from service.models.workbench.diagnosis_json import as_json as diagnosis_as_json, versions_as_json
from service.models.workbench.effect_sheets import explained
from service.models.workbench.fit_summary import values_table
from service.models.workbench.fit_words import words as fit_words
from service.models.workbench.improving import Improved
from service.models.workbench.summary import shown
from service.models.workbench.versions import gain, tables
from service.version import VERSION


def words(found: Improved) -> tuple[str, ...]:
    """Sentences: what was added, why no more, what became of the error, and of the fit."""
    return tuple(_sentences(found))


def summary(found: Improved) -> RenderableType:
    """What was done, and the errors of every version."""
    return Group(*_parts(found))


def as_json(found: Improved) -> dict[str, Any]:
    """SI units, null for what is not known."""
    return finite(
        {
            "version": VERSION,
            "building": found.model.building,
            "taken": list(found.taken),
            "versions": versions_as_json(found.versions, found.records),
            "model": model_as_json(found.model),
            "diagnoses": [diagnosis_as_json(one) for one in found.rounds],
            "explanation": " ".join(words(found)),
        }
    )


def _sentences(found: Improved) -> Iterator[str]:
    for effect in found.taken:
        about = EFFECTS[effect]
        yield f"Added: {about.title} ({effect}). {explained(about, found.model.isolator.effects[effect])}"
    if not found.taken:
        yield "No effect was added; the values were fitted."
    yield f"It ended because {found.ended}."
    yield from gain(found.versions[0], found.versions[-1], found.records)
    yield from fit_words(found.fit, found.inflation)


def _parts(found: Improved) -> Iterator[RenderableType]:
    yield Text("\n".join(words(found)) + "\n")
    for table in tables(found.versions, found.records):
        yield shown(table)
        yield Text(f"{table.note}\n", style="dim")
    yield values_table(found.model)
    for reason in found.records.unused:
        yield Text(f"\nnot used: {reason}", style="dim")
