"""The poller: one at a time, on its own clock, through a database that is away, to a clean end."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic, sleep

from monitoring_server import building_file, miniseed, stream
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.db import leases
from service.db.leases import POLLING, POLLING_LEASE as LEASE
from service.jobs.tables import Lease
from service.poller import Poller
from service.records.tables import Event
from service.settings import Settings

NOW = datetime(2024, 1, 1, tzinfo=UTC)
SETTINGS = Settings(poll_interval=0.1, settle_time=0)


def until(met: Callable[[], bool], seconds: float = 15) -> None:
    end = monotonic() + seconds
    while not met():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.02)


@contextmanager
def polling(sessions: sessionmaker[Session], holder: str = "this one") -> Iterator[Poller]:
    poller, stop = Poller(sessions, SETTINGS, holder), threading.Event()
    thread = threading.Thread(target=poller.run, args=(stop,))
    thread.start()
    try:
        yield poller
    finally:
        stop.set()
        thread.join(15)
        assert not thread.is_alive()


def count(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return len(session.scalars(select(Event)).all())


def test_a_lease_is_one_holders_until_it_lapses(sessions: sessionmaker[Session]) -> None:
    def hold(holder: str, now: datetime) -> bool:
        with sessions.begin() as session:
            return leases.hold(session, POLLING, holder, now, LEASE)

    assert hold("a", NOW)
    assert not hold("b", NOW + LEASE / 2)
    assert hold("a", NOW + LEASE / 2)
    assert not hold("b", NOW + LEASE * 1.2)
    assert hold("b", NOW + LEASE * 1.6)
    assert not hold("a", NOW + LEASE * 1.7)
    with sessions.begin() as session:
        leases.give_up(session, POLLING, "a")
        leases.give_up(session, POLLING, "b")
    assert hold("a", NOW + LEASE * 1.8)


def test_new_files_and_new_buildings_are_detected_while_it_runs(
    sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    with polling(sessions) as poller:
        until(lambda: poller.holds)
        with sessions.begin() as session:
            building_store.add(session, building_file("folder", str(tmp_path)), tmp_path, NOW)
        (tmp_path / "a.mseed").write_bytes(miniseed(stream()))
        until(lambda: count(sessions) == 1)
        (tmp_path / "b.mseed").write_bytes(miniseed(stream(NOW + timedelta(hours=1))))
        until(lambda: count(sessions) == 2)
    with sessions() as session:
        assert session.scalars(select(Lease)).all() == []


def test_a_second_poller_waits_for_the_first(sessions: sessionmaker[Session]) -> None:
    with polling(sessions, "first") as first:
        until(lambda: first.holds)
        with polling(sessions, "second") as second:
            sleep(0.3)
            assert not second.holds
