"""How did the model come about that is in force when the spectator comes?

As an engineer would have made it in the first years: by the design, fitted to the earthquakes there were until then.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from threading import Event as Signal
from typing import Any

from sqlalchemy.orm import Session, sessionmaker

from service.buildings import queries as building_queries
from service.db.sessions import reading
from service.demo.site import CODE
from service.jobs import queries as job_queries
from service.models import queries as model_queries, requests as model_requests, versions as model_versions
from service.models.tables import ModelVersion

BY = "the demonstration"
DIRECTION = "x"
LOOK = 0.5
"""s between two looks at a job."""


@dataclass(frozen=True, slots=True)
class InForce:
    """A version of the building's model that is in force."""

    id: int
    number: int
    accepted_by: str


def in_force(session: Session) -> InForce | None:
    """The version in force, None if there is none."""
    building, _ = building_queries.building(session, CODE)
    found = model_queries.current_versions(session, building.id)
    return InForce(found[0].id, found[0].number, found[0].accepted_by or "") if found else None


def put_in_force(sessions: sessionmaker[Session], stop: Signal) -> None:
    """Make a model, fit it to the earlier half of the events, and hold it against the others; but not twice.

    Ends early when it is asked to stop.
    """
    with reading(sessions)() as session:
        if in_force(session) is not None:
            return
    with sessions.begin() as session:
        design = model_requests.make(session, CODE, DIRECTION, None, "", BY, datetime.now(UTC))
        earlier, later = _halves(session, design)
        fit = model_requests.fit(session, design, earlier, None, BY, datetime.now(UTC)).id
    found = finished(sessions, fit, stop)
    if found is None:
        return
    with sessions.begin() as session:
        made = model_queries.version(session, found["made"])
        model_versions.accept(session, made, BY, datetime.now(UTC))
        compared = [model_requests.compare(session, made, [event], BY, datetime.now(UTC)).id for event in later]
    for job in compared:  # one each, so that several are done at a time
        finished(sessions, job, stop)


def finished(sessions: sessionmaker[Session], job: int, stop: Signal) -> Mapping[str, Any] | None:
    """What came of a job once it is done, None when asked to stop before.

    Raises:
        RuntimeError: it was refused, or failed.
    """
    while not stop.wait(LOOK):
        with reading(sessions)() as session:
            found = job_queries.job(session, job)
        if found.state == "failed" or found.refusal:
            raise RuntimeError(f"the demonstration's own {found.kind} went wrong: {found.refusal or found.error}")
        if found.state == "done":
            return found.result or {}
    return None


def _halves(session: Session, model: ModelVersion) -> tuple[Sequence[int], Sequence[int]]:
    """Numbers of the earlier events and of the later ones."""
    there = model_queries.comparable(session, model.building_id, model_versions.DIRECTIONS[model.direction], None)
    numbers, half = [event.id for event in there], (len(there) + 1) // 2
    return numbers[:half], numbers[half:]
