"""The guided demonstration of a hidden effect: an engineer's first model, then the spectator's next steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from threading import Event as Signal
from typing import Any, Final

from rich.console import Console
from sqlalchemy.orm import Session, sessionmaker

from core.comparison.misfit import Misfit
from service.buildings import queries as building_queries
from service.db.sessions import reading
from service.demo.narration import LOOK, narrate_next, narrate_past
from service.demo.site import CODE
from service.demo.stage import Stage, until_next, write_records
from service.jobs import requests as job_requests
from service.models import queries as model_queries, requests as model_requests, store as model_store
from service.models.schema import FitRequest, ModelRequest, WorkRequest
from service.models.tables import ModelVersion

BY = "the demonstration"
DIRECTION: Final = "x"


@dataclass(frozen=True, slots=True)
class CurrentVersion:
    """A current version of the building's model."""

    id: int
    number: int
    accepted_by: str


def current_version(session: Session) -> CurrentVersion | None:
    """The current version, None if there is none."""
    building, _ = building_queries.building(session, CODE)
    versions = model_queries.current_versions(session, building.id)
    return CurrentVersion(versions[0].id, versions[0].number, versions[0].accepted_by or "") if versions else None


def accept_model(sessions: sessionmaker[Session], stop: Signal) -> None:
    """Create a model, fit it to the earlier half of the events, and compare it with the others; once only.

    Ends early when stopped.
    """
    with reading(sessions)() as session:
        if current_version(session) is not None:
            return
    with sessions.begin() as session:
        by_design = ModelRequest(direction=DIRECTION, effects=None, change="")
        design = model_requests.make(session, CODE, by_design, BY, datetime.now(UTC))
        earlier, later = _halves(session, design)
        wanted = FitRequest(events=list(earlier), hold_out=None)
        fit = model_requests.fit(session, design.id, wanted, BY, datetime.now(UTC)).id
    result = finished(sessions, fit, stop)
    if result is None:
        return
    with sessions.begin() as session:
        made = model_queries.version(session, result["made"])
        model_store.accept(session, made, BY, datetime.now(UTC))
        compared = [_compare(session, made.id, event) for event in later]
    for job in compared:  # one job each, so that several run at a time
        finished(sessions, job, stop)


def _latest(session: Session, model_id: int) -> int:
    """Number of the latest event that a model can be compared with."""
    version = model_queries.version(session, model_id)
    return model_queries.comparable(session, version.building_id, (DIRECTION,), None)[-1].id


def _compare(session: Session, model_id: int, event: int) -> int:
    """Queue the comparison of a model with one event; the job's number."""
    return model_requests.compare(session, model_id, WorkRequest(events=[event]), BY, datetime.now(UTC)).id


def finished(sessions: sessionmaker[Session], job: int, stop: Signal) -> Mapping[str, Any] | None:
    """Result of a job once it is done; None if stopped before.

    Raises:
        RuntimeError: the job was rejected, or failed.
    """
    while not stop.wait(LOOK):
        with reading(sessions)() as session:
            row = job_requests.job(session, job)
        if row.state == "failed" or row.refusal:
            raise RuntimeError(f"the demonstration's own {row.kind} failed: {row.refusal or row.error}")
        if row.state == "done":
            return row.result or {}
    return None


def _halves(session: Session, model: ModelVersion) -> tuple[Sequence[int], Sequence[int]]:
    """Numbers of the earlier and of the later events."""
    there = model_queries.comparable(session, model.building_id, model_queries.DIRECTIONS[model.direction], None)
    numbers, half = [event.id for event in there], (len(there) + 1) // 2
    return numbers[:half], numbers[half:]


SOON = timedelta(seconds=2)
"""Delay of the next earthquake after a model was accepted."""
STEPS = """\
[bold]The current model misses the strong earthquakes.[/] Something is missing in it; find out what:
 1. open {address}/models/{number}: its error over the events, its loop beside the measured one
 2. open its latest earthquake, {address}/events/{event}: the page shows which earthquakes are fitted and which one is
    held out; press "Find what model x {version} lacks"
 3. the diagnosis appears by itself, within a minute: read it, and press "Add" beside the effect that it names
 4. the next version appears by itself: the error has fallen, also on the held-out event
 5. press "Make current" there: one more strong earthquake follows, to which nothing was fitted"""


def guide(address: str, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console) -> None:
    """Guide the spectator from past records to the first earthquake under an accepted model.

    Args:
        address: of the service's pages.
        stage: the simulated world.
        sessions: at the service's database.
        stop: ends the demonstration when set.
        console: for the text.
    """
    narrate_past(len(stage.earthquakes), reading(sessions), stop, console)
    with console.status("an engineer's model of the past years is being fitted to the weak earthquakes"):
        accept_model(sessions, stop)
    with reading(sessions)() as session:
        former = current_version(session)
    if former is None or stop.is_set():
        return
    if former.accepted_by != BY:
        console.print(f"your model x {former.number} is current: {address}/models/{former.id}", highlight=False)
        return
    with reading(sessions)() as session:
        event = _latest(session, former.id)
    steps = STEPS.format(address=address, number=former.id, version=former.number, event=event)
    console.print(steps, highlight=False, soft_wrap=True)
    console.print(
        f"the records lie in {write_records(stage)}, for those who would rather work at a command line", soft_wrap=True
    )
    better = _successor(former, sessions, stop)
    if better is not None:
        console.print(f"model x {better.number} is current", highlight=False)
        _show_predictions(stage, (former, better), sessions, stop, console)


def _successor(former: CurrentVersion, sessions: sessionmaker[Session], stop: Signal) -> CurrentVersion | None:
    """The version that the spectator accepts."""
    while not stop.wait(LOOK):
        with reading(sessions)() as session:
            current = current_version(session)
        if current is not None and current != former:
            return current
    return None


def _show_predictions(
    stage: Stage,
    models: tuple[CurrentVersion, CurrentVersion],
    sessions: sessionmaker[Session],
    stop: Signal,
    console: Console,
) -> None:
    wait = until_next(stage.earthquakes, datetime.now(UTC), SOON)
    if stop.wait(wait.total_seconds()):
        return
    narrate_next(stage, reading(sessions), stop, console)
    errors = [_latest_error(model, sessions, stop) for model in models]
    if stop.is_set():
        return
    results = " and ".join(
        f"x {model.number} misses its force by {error:.1%}" for model, error in zip(models, errors, strict=True)
    )
    console.print(f"[bold]no model was fitted to it: {results}[/]; reload the page of the model", highlight=False)


def _latest_error(model: CurrentVersion, sessions: sessionmaker[Session], stop: Signal) -> float | None:
    """NRMSE of a version for the latest event, None if stopped before."""
    with sessions.begin() as session:
        job = _compare(session, model.id, _latest(session, model.id))
    if finished(sessions, job, stop) is None:
        return None
    with reading(sessions)() as session:
        comparison, _ = model_queries.latest_comparisons(session, [model.id])[model.id][-1]
        return Misfit(**comparison.misfit).nrmse
