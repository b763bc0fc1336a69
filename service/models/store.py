"""Versions of a building's model and their comparisons, written to the database; the current version."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime
from math import isfinite
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit
from core.model.isolator import Isolator
from service.buildings.locking import locked
from service.db.blobs import encode_history
from service.jobs import queue as job_queue
from service.jobs.queue import COMPARE
from service.jobs.tables import Job
from service.models import queries
from service.models.comparing import Compared
from service.models.queries import DIRECTIONS
from service.models.tables import ModelComparison, ModelVersion
from service.records.tables import Event
from service.version import VERSION


@dataclass(frozen=True, slots=True)
class Draft:
    """Content of a new version."""

    direction: str
    isolator: Isolator
    change: str
    """Change and reason."""
    author: str
    revision_id: int
    """Number of the building's description."""
    parent_id: int | None = None
    reference: datetime | None = None
    standard_deviations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """By effect and parameter; infinite where the records did not determine it."""
    assumed: Sequence[str] = ()
    outcome: str | None = None


def add(session: Session, building_id: int, draft: Draft, now: datetime) -> ModelVersion:
    """The next version, a draft as yet."""
    locked(session, building_id)  # two at once get different numbers
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
        standard_deviations=_finite(draft.standard_deviations),
        assumed=list(draft.assumed),
        outcome=draft.outcome,
    )
    session.add(made)
    session.flush()
    return made


def accept(session: Session, model: ModelVersion, by: str, now: datetime) -> None:
    """Make a version current; the former one retires."""
    locked(session, model.building_id)
    of_line = (ModelVersion.building_id == model.building_id, ModelVersion.direction == model.direction)
    for former in session.scalars(select(ModelVersion).where(*of_line, ModelVersion.state == "current")):
        former.state = "retired"
    session.flush()  # before the next one comes into force: there is never more than one
    model.state, model.accepted_by, model.accepted_at = "current", by, now
    job_queue.enqueue_monitoring(session, model.building_id, by, now)


def add_comparisons(
    session: Session, model_id: int, compared: Sequence[Compared], roles: Mapping[int, str], now: datetime
) -> None:
    """Keep a version's comparisons; each replaces an earlier one with the same analysis.

    Args:
        session: of the transaction.
        model_id: of the version.
        compared: its comparisons with events.
        roles: role of each event for the version, by its number.
        now: aware time.
    """
    for one in compared:
        same = (ModelComparison.model_id == model_id, ModelComparison.analysis_id == one.analysis)
        session.execute(delete(ModelComparison).where(*same, ModelComparison.direction == one.direction))
        session.add(
            ModelComparison(
                model_id=model_id,
                event_id=one.event,
                analysis_id=one.analysis,
                direction=one.direction,
                role=roles[one.event],
                created_at=now,
                version=VERSION,
                misfit=asdict(one.misfit),
                displacement=None if one.displacement is None else asdict(one.displacement),
                accelerations=_stored(one.accelerations),
                force=encode_history(one.force),
            )
        )


def follow(session: Session, event: Event, now: datetime) -> list[Job]:
    """Queue the comparison of an event that was analysed with the current models at its building."""
    return [
        job_queue.enqueue_work(session, model, COMPARE, {"events": [event.id]}, None, now)
        for model in queries.current_versions(session, event.building_id)
        if queries.comparable(session, event.building_id, DIRECTIONS[model.direction], [event.id])
    ]


def _stored(accelerations: Mapping[str, Misfit]) -> dict[str, object] | None:
    return {level: asdict(misfit) for level, misfit in accelerations.items()} or None


def _finite(deviations: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    return {
        effect: {name: value if isfinite(value) else None for name, value in own.items()}
        for effect, own in deviations.items()
    }
