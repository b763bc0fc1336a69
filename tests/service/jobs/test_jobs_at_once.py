"""Transactions that queue the same work at the same time, and workers that look meanwhile."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait

import pytest
import stored_histories
from sqlalchemy import update
from sqlalchemy.orm import Session, sessionmaker

from core.model.isolator import Isolator
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.jobs import queue as job_queue
from service.jobs.queue import COMPARE
from service.jobs.tables import Job
from service.models import store as model_store
from service.models.store import Draft
from service.models.tables import ModelVersion
from service.records.tables import Event

NOW = stored_histories.start(40)
MEANWHILE = 0.5
"""s within which a transaction that need not wait has ended."""
Queue = Callable[[Session], Job]


@pytest.fixture
def pool() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(1) as made:
        yield made


@pytest.fixture
def building(sessions: sessionmaker[Session]) -> int:
    with sessions.begin() as session:
        return stored_histories.building(session).id


@pytest.fixture(params=["analysis", "comparison", "watch"])
def queue(request: pytest.FixtureRequest, sessions: sessionmaker[Session], building: int) -> Queue:
    """Queues the same work each time."""
    with sessions.begin() as session:
        event = Event(
            building_id=building, start=NOW, end=NOW, state="queued", reason=None, created_at=NOW, updated_at=NOW
        )
        session.add(event)
        revision = session.get_one(Building, building).revisions[0].id
        draft = Draft("x", Isolator({"elastic": {"k_b": 5e8}}), "by hand", "engineer", revision)
        model = model_store.add(session, building, draft, NOW)
        session.flush()
        event_id, model_id = event.id, model.id
    ways: dict[str, Queue] = {
        "analysis": lambda session: job_queue.enqueue(session, session.get_one(Event, event_id), {}, NOW),
        "comparison": lambda session: job_queue.enqueue_work(
            session, session.get_one(ModelVersion, model_id), COMPARE, {"events": [event_id]}, None, NOW
        ),
        "watch": lambda session: job_queue.enqueue_monitoring(session, building, None, NOW),
    }
    return ways[request.param]


def queued(sessions: sessionmaker[Session], queue: Queue) -> int:
    with sessions.begin() as session:
        number: int = queue(session).id
    return number


def test_two_at_once_queue_one_job(sessions: sessionmaker[Session], queue: Queue, pool: ThreadPoolExecutor) -> None:
    with sessions.begin() as session:
        first = queue(session).id
        second = pool.submit(queued, sessions, queue)
        wait([second], MEANWHILE)
    assert second.result() == first


def test_no_one_takes_a_job_before_what_it_is_to_see_is_stored(
    sessions: sessionmaker[Session], queue: Queue, building: int, pool: ThreadPoolExecutor
) -> None:
    waiting = queued(sessions, queue)

    def name_seen_by_a_worker() -> str | None:
        with sessions.begin() as session:
            claim = job_queue.claim(session, NOW, stored_histories.LEASE)
            return None if claim is None else session.get_one(Building, building).name

    with sessions.begin() as session:
        session.execute(update(Building).where(Building.id == building).values(name="as stored now"))
        assert queue(session).id == waiting
        worker = pool.submit(name_seen_by_a_worker)
        wait([worker], MEANWHILE)
    assert worker.result() in (None, "as stored now")
    with sessions.begin() as session:
        held = session.get_one(Job, waiting)
        assert held.state == ("waiting" if worker.result() is None else "running")


def test_a_job_before_one_that_was_begun_later_will_not_do(sessions: sessionmaker[Session], queue: Queue) -> None:
    first = queued(sessions, queue)
    with sessions.begin() as session:
        held = job_queue.claim(session, NOW, stored_histories.LEASE)
    assert held is not None
    second = queued(sessions, queue)
    with sessions.begin() as session:
        assert job_queue.claim(session, NOW, stored_histories.LEASE)
        assert job_queue.release(session, held)
    assert queued(sessions, queue) > second > first


def test_an_analysis_is_stored_while_records_come_in(
    sessions: sessionmaker[Session], building: int, pool: ThreadPoolExecutor
) -> None:
    """A reader of a record locks the building, then its event; so must the code that stores the event's result."""
    found = stored_histories.earthquake(0)
    with sessions.begin() as session:
        job = stored_histories.queue_analysis(session, building, found.start, NOW)
    with sessions.begin() as session:
        event_id = session.get_one(Job, job).event_id
        claim = stored_histories.claim_next(session, NOW)

    def stored() -> None:
        with sessions.begin() as session:
            stored_histories.store(session, claim, found, NOW)

    with sessions.begin() as session:
        locked(session, building)
        storing = pool.submit(stored)
        wait([storing], MEANWHILE)
        session.get_one(Event, event_id).end += stored_histories.SECONDS
    storing.result()
