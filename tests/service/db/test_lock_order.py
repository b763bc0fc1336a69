"""Transactions about one building at once: none waits for a row of another one that waits for it."""

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
import stored_histories
from at_once import interleave
from sqlalchemy import delete, select
from sqlalchemy.orm import Session, sessionmaker

from core.comparison.misfit import Misfit
from core.model.isolator import Isolator
from service.alerts.checked_buildings import Checked
from service.alerts.periodic_checks import check_buildings
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.buildings.tables import Building, Revision
from service.drift.tables import DriftState, DriftValue
from service.jobs import queue as job_queue, requests as job_requests
from service.jobs.queue import COMPARE, Claim
from service.jobs.tables import Job
from service.kinds import KINDS
from service.models import store as model_store
from service.models.comparing import Compared, Comparison
from service.models.store import Draft
from service.models.tables import ModelComparison, ModelVersion
from service.records import recordings
from service.records.ingest import parse, take_in
from service.records.originals import secured
from service.records.tables import Event, Recording
from service.settings import Settings
from service.verdict.tables import BuildingLevel

pytestmark = pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)

SETTINGS = Settings()
COUNT = 24
NOW = stored_histories.start(COUNT)
LOCKED = r"FROM building\s.*FOR (NO KEY )?UPDATE"


@pytest.fixture
def building(sessions: sessionmaker[Session]) -> int:
    with sessions.begin() as session:
        return stored_histories.building(session).id


def begun_analysis(sessions: sessionmaker[Session], building: int, number: int) -> Claim:
    """The claim of an analysis of the earthquake of that number."""
    with sessions.begin() as session:
        stored_histories.queue_analysis(session, building, stored_histories.start(number), NOW)
    with sessions.begin() as session:
        return stored_histories.claim_next(session, NOW)


def store_analysis(sessions: sessionmaker[Session], claim: Claim, number: int) -> None:
    with sessions.begin() as session:
        stored_histories.store(session, claim, stored_histories.earthquake(number), NOW)


def test_a_periodic_check_beside_the_monitoring_of_a_building(sessions: sessionmaker[Session], building: int) -> None:
    """The check writes the level of a building and then rows that refer to it; the monitoring locks it first."""
    last: dict[int, Checked] = {}
    with sessions.begin() as session:
        job_queue.enqueue_monitoring(session, building, None, NOW)
    check_buildings(sessions, SETTINGS, NOW, last=last)
    later = NOW + timedelta(minutes=1)
    interleave(
        sessions,
        lambda: stored_histories.do_waiting_work(sessions, NOW),
        LOCKED,
        lambda: check_buildings(sessions, SETTINGS, later, last=last),
    )
    with sessions() as session:
        assert session.scalars(select(Job.state)).all() == ["done"]
        assert session.scalars(select(BuildingLevel.building_id)).all() == [building]


def test_an_analysis_beside_the_monitoring_of_its_event(sessions: sessionmaker[Session], building: int) -> None:
    """Monitored values refer to the event, which the other one locks after the building."""
    stored_histories.store_and_monitor(sessions, building, stored_histories.store_history(COUNT), NOW)
    claim = begun_analysis(sessions, building, 1)
    with sessions.begin() as session:
        session.execute(delete(DriftValue))
        session.execute(delete(DriftState))
        job_queue.enqueue_monitoring(session, building, None, NOW)
    interleave(
        sessions,
        lambda: stored_histories.do_waiting_work(sessions, NOW),
        "INSERT INTO drift_value",
        lambda: store_analysis(sessions, claim, 1),
    )
    with sessions() as session:
        assert session.scalar(select(Analysis.job_id).where(Analysis.current, Analysis.job_id == claim.job_id))


def test_an_analysis_beside_a_comparison_with_its_event(sessions: sessionmaker[Session], building: int) -> None:
    store_analysis(sessions, begun_analysis(sessions, building, 0), 0)
    stored_histories.do_waiting_work(sessions, NOW)
    with sessions.begin() as session:
        revision = session.scalars(select(Revision.id)).one()
        isolator = Isolator({"elastic": {"k_b": 5e8}})
        model = model_store.add(session, building, Draft("x", isolator, "by hand", "engineer", revision), NOW)
        model_store.accept(session, model, "engineer", NOW)
        analysis = session.scalars(select(Analysis)).one()
        job = job_queue.enqueue_work(session, model, COMPARE, {"events": [analysis.event_id]}, None, NOW)
        claim = Claim(job.id, COMPARE, None, model.id, None, job.arguments, 1, 0)
        inputs = KINDS[COMPARE].inputs(session, claim, SETTINGS)
        misfit = Misfit(4, 1.0, 1.0, 1.0, 1.0)
        compared = Compared(analysis.event_id, analysis.id, "x", np.zeros(4), misfit, None, {})
    again = begun_analysis(sessions, building, 0)

    def store_comparison() -> None:
        with sessions.begin() as session:
            KINDS[COMPARE].store(session, claim, inputs, (Comparison((compared,), ()),), NOW)

    interleave(sessions, store_comparison, "INSERT INTO model_comparison", lambda: store_analysis(sessions, again, 0))
    with sessions() as session:
        assert session.scalars(select(ModelComparison.model_id)).all() == session.scalars(select(ModelVersion.id)).all()


def test_a_new_description_beside_a_recording_that_is_read(sessions: sessionmaker[Session], building: int) -> None:
    """A new description has rejected recordings read again, and renames the building."""
    with sessions.begin() as session:
        of_it = session.get_one(Building, building)
        made = recordings.store(session, of_it, "a", "/in/a", secured(b"no record", SETTINGS.storage), NOW)
        made.reason = "the service ended while it was read"
        text = of_it.revisions[-1].toml.replace('name = "', 'name = "New ', 1)

    def read() -> None:
        with sessions.begin() as session:
            recording = session.get_one(Recording, made.id)
            parsed = parse(session, recording, settings=SETTINGS)
            take_in(session, recording, parsed, NOW, settings=SETTINGS)

    def describe() -> None:
        with sessions.begin() as session:
            building_store.update_description(session, text, Path("/"), NOW)

    interleave(sessions, read, LOCKED, describe)
    with sessions() as session:
        assert session.scalars(select(Building.name)).one().startswith("New ")
        assert session.scalars(select(Recording.state)).one() == "stored"


def test_an_analysis_that_is_cancelled_and_requested_again(sessions: sessionmaker[Session], building: int) -> None:
    """The event then waits for the second one, whichever was first."""
    with sessions.begin() as session:
        event = Event(building_id=building, start=NOW, end=NOW, state="gathering", created_at=NOW, updated_at=NOW)
        session.add(event)
        session.flush()
        first = job_queue.enqueue(session, event, {}, NOW, "engineer").id

    def cancel() -> None:
        with sessions.begin() as session:
            job_requests.cancel(session, session.get_one(Job, first), NOW + timedelta(minutes=1))

    def request() -> None:
        with sessions.begin() as session:
            job_queue.enqueue(session, session.get_one(Event, event.id), {}, NOW)

    interleave(sessions, cancel, r"FROM job\s.*FOR UPDATE", request)
    with sessions() as session:
        assert session.scalars(select(Job.state).order_by(Job.id)).all() == ["cancelled", "waiting"]
        assert session.scalars(select(Event.state)).one() == "queued"
