"""Results of the work on a model, written to the database; work that a new event starts."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime

from sqlalchemy import delete
from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit
from service.db.blobs import encode_history
from service.jobs import queue as job_queue
from service.jobs.queue import COMPARE
from service.jobs.tables import Job
from service.models import queries
from service.models.tables import ModelComparison
from service.models.versions import DIRECTIONS
from service.models.work import Compared
from service.records.tables import Event
from service.version import VERSION


def store_comparisons(
    session: Session, model_id: int, found: Sequence[Compared], roles: Mapping[int, str], now: datetime
) -> None:
    """Keep what a version's comparisons found; each takes the place of an earlier one with the same analysis.

    Args:
        session: of the transaction.
        model_id: of the version.
        found: what it was held against.
        roles: what each event is to the version, by its number.
        now: aware time.
    """
    for one in found:
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
                accelerations=_kept(one.accelerations),
                force=encode_history(one.force),
            )
        )


def follow(session: Session, event: Event, now: datetime) -> list[Job]:
    """Queue the comparison of an event that was analysed with the models in force at its building."""
    return [
        job_queue.enqueue_work(session, model, COMPARE, {"events": [event.id]}, None, now)
        for model in queries.current_versions(session, event.building_id)
        if queries.comparable(session, event.building_id, DIRECTIONS[model.direction], [event.id])
    ]


def _kept(accelerations: Mapping[str, Misfit]) -> dict[str, object] | None:
    return {level: asdict(misfit) for level, misfit in accelerations.items()} or None
