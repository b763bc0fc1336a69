"""The poller: several share the buildings, each on its own clock, through a database that is away, to a clean end."""

import threading
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic, sleep

from monitoring_server import building_file, miniseed, stream
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.db import process_leases
from service.db.process_leases import POLLING, POLLING_LEASE as LEASE, SHARING
from service.jobs.tables import Lease
from service.poller import Poller, owner
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
            return process_leases.hold(session, POLLING, holder, now, LEASE)

    assert hold("a", NOW)
    assert not hold("b", NOW + LEASE / 2)
    assert hold("a", NOW + LEASE / 2)
    assert not hold("b", NOW + LEASE * 1.2)
    assert hold("b", NOW + LEASE * 1.6)
    assert not hold("a", NOW + LEASE * 1.7)
    with sessions.begin() as session:
        process_leases.give_up(session, POLLING, "a")
        process_leases.give_up(session, POLLING, "b")
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


def test_pollers_share_the_buildings_and_a_dead_ones_are_taken_over(
    sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    codes = frozenset(f"B{number}" for number in range(8))
    (folder := tmp_path / "records").mkdir()
    text = building_file("folder", str(folder))
    code = tomllib.loads(text)["code"]
    with sessions.begin() as session:
        for one in codes:
            building_store.add(session, text.replace(f'"{code}"', f'"{one}"', 1), tmp_path, NOW)
    with polling(sessions, "first") as first:
        until(lambda: first.share == codes)
        with polling(sessions, "second") as second:
            until(lambda: bool(second.share))
            until(lambda: first.share | second.share == codes and not first.share & second.share)
            assert first.share
            assert second.share
            assert first.holds
            assert not second.holds
        until(lambda: first.share == codes)
        with sessions.begin() as session:
            process_leases.hold(session, SHARING + "dead", "dead", datetime.now(UTC), LEASE)
        until(lambda: first.share < codes)
        with sessions.begin() as session:
            session.get_one(Lease, SHARING + "dead").until = datetime.now(UTC) - LEASE
        until(lambda: first.share == codes)


def test_a_poller_that_joins_polls_nothing_until_every_other_has_seen_it(
    sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    """Another poller holds its lease and is silent at first; then it renews the lease, and with that sees this one."""
    codes = [f"B{number}" for number in range(8)]
    text = building_file("folder", str(tmp_path))
    with sessions.begin() as session:
        for one in codes:
            building_store.add(session, text.replace(f'"{tomllib.loads(text)["code"]}"', f'"{one}"', 1), tmp_path, NOW)
        process_leases.hold(session, SHARING + "other", "other", datetime.now(UTC), LEASE)
    with polling(sessions, "this one") as poller:
        until(lambda: poller.met is not None)
        sleep(5 * SETTINGS.polling.interval)
        assert poller.share == frozenset()
        with sessions.begin() as session:
            process_leases.hold(session, SHARING + "other", "other", datetime.now(UTC), LEASE)
        until(lambda: poller.share == {one for one in codes if owner(one, {"this one", "other"}) == "this one"})


def test_a_poller_that_joins_takes_buildings_from_every_other_and_moves_no_other() -> None:
    codes = [f"B{number}" for number in range(300)]
    before = {one: owner(one, {"a", "b"}) for one in codes}
    after = {one: owner(one, {"a", "b", "c"}) for one in codes}
    assert {one for one in codes if before[one] != after[one]} == {one for one in codes if after[one] == "c"}
    assert all(list(after.values()).count(name) > 60 for name in "abc")
