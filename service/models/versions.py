"""Versions of a building's model: their creation, and the one in force."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from math import isfinite
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from core.model.isolator import Isolator
from service.buildings.tables import Building
from service.jobs import queue as job_queue
from service.models.tables import ModelVersion
from service.version import VERSION

DIRECTIONS: Mapping[str, tuple[str, ...]] = {"x": ("x",), "y": ("y",), "xy": ("x", "y")}
"""Horizontal directions that a model of such a direction holds in."""


@dataclass(frozen=True, slots=True)
class Draft:
    """What a new version is to be."""

    direction: str
    isolator: Isolator
    change: str
    """Change and reason."""
    author: str
    revision_id: int
    """Of the building's description."""
    parent_id: int | None = None
    reference: datetime | None = None
    standard_deviations: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """By effect and parameter; infinite where the records did not determine it."""
    assumed: Sequence[str] = ()
    outcome: str | None = None


def add(session: Session, building_id: int, draft: Draft, now: datetime) -> ModelVersion:
    """The next version, a draft as yet."""
    session.get_one(Building, building_id, with_for_update=True)  # two at once get different numbers
    of_line = (ModelVersion.building_id == building_id, ModelVersion.direction == draft.direction)
    last = session.scalar(select(func.max(ModelVersion.number)).where(*of_line))
    made = ModelVersion(
        building_id=building_id,
        direction=draft.direction,
        number=(last or 0) + 1,
        parent_id=draft.parent_id,
        state="draft",
        change=draft.change,
        author=draft.author,
        created_at=now,
        version=VERSION,
        revision_id=draft.revision_id,
        reference=draft.reference,
        effects={name: dict(values) for name, values in draft.isolator.effects.items()},
        standard_deviations=_by_effect(draft.standard_deviations),
        assumed=list(draft.assumed),
        outcome=draft.outcome,
    )
    session.add(made)
    session.flush()
    return made


def accept(session: Session, model: ModelVersion, by: str, now: datetime) -> None:
    """Put a version in force; the one that was retires."""
    session.get_one(Building, model.building_id, with_for_update=True)
    of_line = (ModelVersion.building_id == model.building_id, ModelVersion.direction == model.direction)
    for former in session.scalars(select(ModelVersion).where(*of_line, ModelVersion.state == "current")):
        former.state = "retired"
    session.flush()  # before the next one comes into force: there is never more than one
    model.state, model.accepted_by, model.accepted_at = "current", by, now
    job_queue.enqueue_monitoring(session, model.building_id, by, now)


def _by_effect(deviations: Mapping[tuple[str, str], float]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for (effect, parameter), value in deviations.items():
        found.setdefault(effect, {})[parameter] = value if isfinite(value) else None
    return found
