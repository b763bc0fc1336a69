"""A clock that is set back or ahead, or was wrong for a while, stops nothing."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic, sleep

import alert_fixtures
import databases
import pytest
from fake_clock import FakedClock
from monitoring_server import START, building_file, miniseed, stream
from processes import running_command
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS
from service.db import process_leases, sessions as opened
from service.db.process_leases import has_passed
from service.jobs import queue as job_queue
from service.jobs.tables import Job
from service.notify import claims, housekeeping
from service.notify.claims import RetryPolicy
from service.notify.outbox import MessageContent, put
from service.notify.tables import Delivery, Receiver
from service.records import events
from service.records.tables import Event, Recording, SourceState
from service.settings import Settings

NOW = datetime(2024, 1, 1, tzinfo=UTC)
BACK = NOW - timedelta(hours=2)
EVERYTHING = {"kinds": list(WANTED_KINDS), "severities": list(SEVERITIES)}
LEASE = timedelta(seconds=60)
QUICK = {"MENSHIN_POLLING__INTERVAL": "1", "MENSHIN_POLLING__SETTLE_TIME": "0"}


@pytest.mark.parametrize(
    ("seconds", "is_over"), [(-1, True), (0, True), (1, False), (60, False), (120, False), (121, True), (7200, True)]
)
def test_an_end_further_ahead_than_it_can_be_has_passed(seconds: int, is_over: bool) -> None:
    """A length more is left for the clocks of two machines, which differ."""
    assert has_passed(NOW + timedelta(seconds=seconds), NOW, LEASE) == is_over


def test_a_lease_of_before_the_clock_was_set_back_is_free(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        assert process_leases.hold(session, "polling", "a", NOW, LEASE)
        assert not process_leases.hold(session, "polling", "b", NOW - LEASE / 2, LEASE)
        assert process_leases.hold(session, "polling", "b", BACK, LEASE)


def test_work_claimed_before_the_clock_was_set_back_is_claimed_again(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        earthquake = alert_fixtures.earthquake(session, alert_fixtures.building(session), NOW)
        session.execute(update(Job).values(state="done"))
        job_queue.enqueue(session, earthquake, {"rate": 50.0}, NOW)
        first = job_queue.claim(session, NOW, LEASE)
        assert first is not None
        assert job_queue.claim(session, NOW - LEASE / 2, LEASE) is None
        again = job_queue.claim(session, BACK, LEASE)
        assert again is not None
        assert again.job_id == first.job_id
        session.flush()
        assert not job_queue.finish(session, first, NOW), "who had it before may no longer write"


def test_a_message_put_off_before_the_clock_was_set_back_is_sent(sessions: sessionmaker[Session]) -> None:
    patience = RetryPolicy(attempts=9, delay=timedelta(seconds=10), longest=timedelta(minutes=10))
    with sessions.begin() as session:
        delivery = delivered(session, "email")
        delivery.state, delivery.due_at = "waiting", NOW + patience.longest
        session.flush()
        assert claims.claim(session, NOW, LEASE, patience) is None
        assert claims.claim(session, BACK, LEASE, patience) is not None
        assert claims.claim(session, BACK, LEASE, patience) is None, "it is being sent"
        assert claims.claim(session, BACK - timedelta(hours=2), LEASE, patience) is not None


def test_what_alertmanager_has_to_hear_again_does_not_wait_for_the_old_time(sessions: sessionmaker[Session]) -> None:
    interval = timedelta(minutes=1)
    with sessions.begin() as session:
        delivered(session, "alertmanager").kept_at = NOW
        session.flush()
        assert not housekeeping.due_to_resend(session, NOW + interval / 2, interval)
        assert len(housekeeping.due_to_resend(session, NOW + interval, interval)) == 1
        assert len(housekeeping.due_to_resend(session, BACK, interval)) == 1


def test_an_earthquake_of_before_the_clock_was_set_back_is_analysed(sessions: sessionmaker[Session]) -> None:
    settings = Settings(event_grace=120)
    with sessions.begin() as session:
        of = alert_fixtures.building(session)
        session.add(Event(building_id=of.id, start=NOW, end=NOW, state="gathering", created_at=NOW, updated_at=NOW))
        session.flush()
        assert events.queue_ready(session, NOW, settings=settings) == 0
        assert events.queue_ready(session, BACK, settings=settings) == 1


def delivered(session: Session, kind: str) -> Delivery:
    """A message about an alert, as it came to a receiver."""
    of = alert_fixtures.building(session)
    to = Receiver(building_id=of.id, name="a", kind=kind, address="a", origin="api", created_at=NOW, **EVERYTHING)
    session.add(to)
    session.flush()
    printed = MessageContent("alert/1", of.id, "alert", "new", "alarm", "Softer", ("The isolators are softer.",))
    (delivery,) = put(session, printed, NOW).deliveries
    delivery.state = "delivered"
    return delivery


@pytest.fixture
def clock(tmp_path: Path) -> FakedClock:
    made = FakedClock(tmp_path / "clock")
    made.ahead(0)
    return made


@pytest.fixture
def incoming(tmp_path: Path) -> Path:
    folder = tmp_path / "incoming"
    folder.mkdir()
    return folder


@pytest.fixture
def url(tmp_path: Path, incoming: Path) -> str:
    """A database with a building whose records come into a folder."""
    made = databases.sqlite(tmp_path)
    with opened.sessions(made).begin() as session:
        building_store.add(session, building_file("folder", str(incoming)), incoming, NOW)
    return made


def until_taken(url: str, incoming: Path, number: int) -> None:
    """A new record comes in and is read; at a second's interval that takes seconds, unless looks have stopped."""
    (incoming / f"{number}.mseed").write_bytes(miniseed(stream(START + timedelta(hours=number), seconds=5)))
    end = monotonic() + 120
    while True:
        with opened.sessions(url)() as session:
            if session.scalar(select(func.count()).where(Recording.state == "read")) == number:
                return
        assert monotonic() < end, "looks have stopped"
        sleep(0.1)


@contextmanager
def polling(folder: Path, url: str, clock: FakedClock) -> Iterator[None]:
    """A poller that has started."""
    output = folder / "output"
    before = output.stat().st_size if output.exists() else 0
    with running_command(folder, url, "poll", **QUICK, **clock.environment):
        end = monotonic() + 120
        while "polling here" not in output.read_text()[before:]:
            assert monotonic() < end, "it did not start to poll"
            sleep(0.1)
        yield


@pytest.mark.slow
def test_looks_go_on_while_the_clock_is_set_back_and_ahead(
    url: str, incoming: Path, tmp_path: Path, clock: FakedClock
) -> None:
    with polling(tmp_path, url, clock):
        for number, ahead in enumerate((0, -7200, 30 * 86400, 0), start=1):
            clock.ahead(ahead)
            until_taken(url, incoming, number)
            until_looked_again(url, ahead)
        assert set_back(tmp_path) == {7200, 30 * 86400}


def until_looked_again(url: str, ahead: int) -> None:
    """Three looks end at the new time: one that was under way or due when the clock was set, and two after it."""
    ends, end = set[datetime](), monotonic() + 120
    while len(ends) < 3:
        assert monotonic() < end, "looks have stopped"
        with opened.sessions(url)() as session:
            looked_at = session.scalars(select(SourceState.looked_at)).one()
        if looked_at is not None and abs(looked_at - datetime.now(UTC) - timedelta(seconds=ahead)) < timedelta(hours=1):
            ends.add(looked_at)
        sleep(0.1)


def set_back(folder: Path) -> set[int]:
    """s, to ten minutes, by which the poller says that the clock was set back."""
    told = re.findall(r"the clock was set back by about (\d+) s", (folder / "output").read_text())
    return {round(float(seconds) / 600) * 600 for seconds in told}


@pytest.mark.slow
def test_a_record_that_came_while_the_clock_was_set_back_is_read_when_it_is_right(
    url: str, incoming: Path, tmp_path: Path, clock: FakedClock
) -> None:
    """It is rejected as of the future first; one earthquake comes of it."""
    clock.ahead(-3 * 86400)
    with polling(tmp_path, url, clock):
        record = stream(datetime.now(UTC) - timedelta(minutes=2), seconds=5)
        (incoming / "a.mseed").write_bytes(miniseed(record))
        until_states(url, ["refused"])
        clock.ahead(0)
        until_states(url, ["read"])
        until_looked_again(url, 0)
    with opened.sessions(url)() as session:
        assert session.scalars(select(Event.state)).all() == ["queued"]
        assert session.scalar(select(func.count()).select_from(Job)) == 1
        assert session.scalars(select(Recording.state)).all() == ["read"]


def until_states(url: str, states: list[str]) -> None:
    """The recordings have these states."""
    end = monotonic() + 120
    while True:
        with opened.sessions(url)() as session:
            if session.scalars(select(Recording.state)).all() == states:
                return
        assert monotonic() < end, "looks have stopped"
        sleep(0.1)


@pytest.mark.slow
def test_looks_go_on_after_a_poller_died_whose_clock_was_ahead(
    url: str, incoming: Path, tmp_path: Path, clock: FakedClock
) -> None:
    clock.ahead(7200)
    with polling(tmp_path, url, clock):
        until_taken(url, incoming, 1)
    clock.ahead(0)
    with polling(tmp_path, url, clock):
        until_taken(url, incoming, 2)
