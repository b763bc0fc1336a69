"""Claims: one at a time, lapsing, fenced."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.tables import Building
from service.errors import ConflictError, TooManyRequestsError
from service.jobs import queue as job_queue, requests as job_requests
from service.jobs.tables import Job
from service.records.tables import Event

NOW = datetime(2024, 1, 1, tzinfo=UTC)
LEASE = timedelta(minutes=2)


@pytest.fixture
def queue(sessions: sessionmaker[Session]) -> Callable[..., int]:
    """Queues a job for an event of its own."""
    with sessions.begin() as session:
        building = Building(code="B", name="tower", created_at=NOW)
        session.add(building)
        session.flush()
        building_id = building.id

    def queue(key: str | None = None, **arguments: object) -> int:
        with sessions.begin() as session:
            event = Event(
                building_id=building_id, start=NOW, end=NOW, state="gathering", created_at=NOW, updated_at=NOW
            )
            session.add(event)
            session.flush()
            return job_queue.enqueue(session, event, arguments, NOW, key).id

    return queue


def claim(sessions: sessionmaker[Session], after: timedelta = timedelta(0)) -> job_queue.Claim | None:
    with sessions.begin() as session:
        return job_queue.claim(session, NOW + after, LEASE)


def state(sessions: sessionmaker[Session], job_id: int) -> tuple[str, str]:
    with sessions() as session:
        job = session.get_one(Job, job_id)
        return job.state, job.event.state


def test_a_job_is_claimed_once_oldest_first(sessions: sessionmaker[Session], queue: Callable[..., int]) -> None:
    first, second = queue(), queue()
    claims = [claim(sessions) for _ in range(3)]
    assert [held and held.job_id for held in claims] == [first, second, None]


def test_the_strongest_earthquake_is_analysed_first(sessions: sessionmaker[Session], queue: Callable[..., int]) -> None:
    jobs = [queue() for _ in range(4)]
    with sessions.begin() as session:
        for job, peak in zip(jobs, (None, 0.1, 3.0, 0.1), strict=True):
            session.get_one(Job, job).event.recorded_peak = peak
    claims = [claim(sessions) for _ in jobs]
    assert [held and held.job_id for held in claims] == [jobs[2], jobs[1], jobs[3], jobs[0]]


def test_a_building_is_compared_before_the_next_ones_earthquake_is_analysed(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    """The comparison is what a verdict and its messages wait for: in a great earthquake nobody would have one."""
    last = queue()
    with sessions.begin() as session:
        other = Building(code="C", name="tower", created_at=NOW)
        session.add(other)
        session.flush()
        own = session.get_one(Job, last).event.building_id
        completing = job_queue.enqueue_monitoring(session, other.id, None, NOW).id
        early = job_queue.enqueue_monitoring(session, own, None, NOW).id
    claims = [claim(sessions) for _ in range(3)]
    assert [held and held.job_id for held in claims] == [completing, last, early], "its own earthquakes come before it"


def test_a_like_job_that_waits_is_enough(sessions: sessionmaker[Session], queue: Callable[..., int]) -> None:
    waiting = queue(estimator="cms")
    with sessions.begin() as session:
        event = session.get_one(Job, waiting).event
        assert job_queue.enqueue(session, event, {"estimator": "cms"}, NOW).id == waiting
        assert job_queue.enqueue(session, event, {"sensors": ["base", "roof"]}, NOW).id != waiting


def test_a_job_that_runs_does_not_stand_for_one_that_is_requested_now(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    running = queue()
    assert claim(sessions)
    with sessions.begin() as session:
        assert job_queue.enqueue(session, session.get_one(Job, running).event, {}, NOW).id != running


def test_a_dead_workers_claim_lapses_and_its_late_result_is_refused(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    job = queue()
    dead = claim(sessions)
    assert dead is not None
    assert claim(sessions, LEASE / 2) is None
    heir = claim(sessions, 2 * LEASE)
    assert heir is not None
    assert (heir.job_id, heir.token) == (job, dead.token + 1)
    with sessions.begin() as session:
        assert not job_queue.extend(session, dead, NOW + 2 * LEASE, LEASE)
        assert not job_queue.release(session, dead)
        assert not job_queue.fail(session, dead, "too late", NOW, attempts=1)
        assert not job_queue.finish(session, dead, NOW)
        assert job_queue.finish(session, heir, NOW)
        assert not job_queue.finish(session, heir, NOW)
    assert state(sessions, job)[0] == "done"


def test_an_extended_lease_holds(sessions: sessionmaker[Session], queue: Callable[..., int]) -> None:
    queue()
    held = claim(sessions)
    assert held is not None
    with sessions.begin() as session:
        assert job_queue.extend(session, held, NOW + LEASE / 2, LEASE)
    assert claim(sessions, LEASE * 1.4) is None
    assert claim(sessions, LEASE * 1.6) is not None


def test_a_job_fails_after_its_last_attempt_and_the_event_shows_the_reason(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    job = queue()
    for attempt in range(1, 4):
        held = claim(sessions)
        assert held is not None
        with sessions.begin() as session:
            assert job_queue.fail(session, held, "Traceback ...\nValueError: a bug", NOW, attempts=3)
        assert state(sessions, job) == (("waiting", "queued") if attempt < 3 else ("failed", "failed"))
    assert claim(sessions) is None
    with sessions() as session:
        assert session.get_one(Job, job).event.reason == "ValueError: a bug"


def test_a_job_over_which_workers_die_holds_up_no_other(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    deadly = queue()
    assert claim(sessions)
    others = {queue(), queue()}
    claims = [claim(sessions, 2 * LEASE) for _ in range(3)]
    assert {held.job_id for held in claims[:2] if held} == others
    assert claims[2] is not None
    assert claims[2].job_id == deadly


def test_a_new_earthquake_comes_before_two_hundred_requests(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    requested = [queue(estimator="cms", key=f"engineer {number % 4}") for number in range(200)]
    earthquake = queue()
    order = [claim(sessions) for _ in range(2)]
    assert [held and held.job_id for held in order] == [earthquake, requested[0]]


def test_what_an_earthquake_needs_by_itself_comes_before_requests(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    requested = queue(key="engineer")
    with sessions.begin() as session:
        event = session.get_one(Job, requested).event
        assert event is not None
        watch = job_queue.enqueue_monitoring(session, event.building_id, None, NOW).id
    order = [claim(sessions) for _ in range(2)]
    assert [held and held.job_id for held in order] == [watch, requested]


def test_a_job_that_workers_die_of_does_not_hold_up_requests(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    earthquake, requested = queue(), queue(key="engineer")
    for _ in range(job_queue.WORN):
        held = claim(sessions)
        assert held is not None
        assert held.job_id == earthquake
        with sessions.begin() as session:
            assert job_queue.release(session, held)
    held = claim(sessions)
    assert held is not None
    assert held.job_id == requested


def test_a_request_that_menshin_needs_too_becomes_urgent(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    queue(key="engineer")
    later = queue(key="engineer")
    with sessions.begin() as session:
        event = session.get_one(Job, later).event
        assert event is not None
        assert job_queue.enqueue(session, event, {}, NOW).id == later
    held = claim(sessions)
    assert held is not None
    assert held.job_id == later


def test_one_key_has_a_limited_number_of_jobs_under_way(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    requested = [queue(key="busy") for _ in range(job_queue.MOST_REQUESTED)]
    with pytest.raises(TooManyRequestsError, match="'busy' has 100 jobs under way"):
        queue(key="busy")
    queue(key="another")
    queue()
    with sessions.begin() as session:
        job_requests.cancel(session, session.get_one(Job, requested[0]), NOW)
    queue(key="busy")


def test_a_cancelled_request_gives_the_event_its_outcome_back(
    sessions: sessionmaker[Session], queue: Callable[..., int]
) -> None:
    first = queue()
    for _ in range(3):
        held = claim(sessions)
        assert held is not None
        with sessions.begin() as session:
            assert job_queue.fail(session, held, "Traceback\nMemoryError: 74 GiB", NOW, 3)
    with sessions.begin() as session:
        event = session.get_one(Job, first).event
        assert event is not None
        again = job_queue.enqueue(session, event, {}, NOW, "engineer").id
    with sessions.begin() as session:
        job_requests.cancel(session, session.get_one(Job, again), NOW)
    assert state(sessions, again) == ("cancelled", "failed")
    assert claim(sessions) is None
    with sessions() as session:
        event = session.get_one(Job, first).event
        assert event is not None
        assert event.reason == "MemoryError: 74 GiB"


def test_a_result_of_a_cancelled_job_is_refused(sessions: sessionmaker[Session], queue: Callable[..., int]) -> None:
    job = queue(key="engineer")
    held = claim(sessions)
    assert held is not None
    with sessions.begin() as session:
        assert job_queue.still_running(session, [held]) == {job}
        job_requests.cancel(session, session.get_one(Job, job), NOW)
    with sessions.begin() as session:
        assert job_queue.still_running(session, [held]) == set()
        assert not job_queue.finish(session, held, NOW)


@pytest.mark.parametrize("kind", ["automatic", "ended"])
def test_what_cannot_be_cancelled(sessions: sessionmaker[Session], queue: Callable[..., int], kind: str) -> None:
    job = queue(key=None if kind == "automatic" else "engineer")
    held = claim(sessions)
    assert held is not None
    with sessions.begin() as session:
        if kind == "ended":
            job_queue.finish(session, held, NOW)
    with sessions.begin() as session, pytest.raises(ConflictError, match=r"itself needs|ended already: done"):
        job_requests.cancel(session, session.get_one(Job, job), NOW)
