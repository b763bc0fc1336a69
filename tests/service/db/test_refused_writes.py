"""A database that can be read but not written for a while, as on a full disk, loses nothing and doubles nothing."""

import logging
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event as Signal, Thread
from time import monotonic, sleep

import databases
import pytest
import small_disks
from api_client import client as opened_client
from cached_executor import CachedExecutor
from monitoring_server import building_file, miniseed, stream
from receivers import WebhookServer, webhook_server
from rendered_messages import KEY
from sqlalchemy import event, func, select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import periodic_checks
from service.analyses.tables import Analysis
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.db import sessions as opened
from service.db.sessions import reading
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.notify.notifier import Notifier
from service.notify.tables import Delivery, DeliveryAttempt, Message
from service.poller import Poller
from service.records.source_poller import SourcePoller
from service.records.tables import Event, Recording
from service.settings import Settings

FILES = 4
SETTINGS = Settings(
    workers=1,
    poll_interval=0.1,
    settle_time=0,
    event_grace=0,
    inside_allowed=("localhost",),
    plain_http_allowed=True,
    notice_delay=0.1,
    data_health={"disk_reserve": 0},  # an alert about the disk would be a message more
)
FULL = "is on a full disk; free some space"
PARTS = {"service.poller", "service.jobs.worker", "service.notify.notifier"}
REFUSALS = {
    "full": (("PRAGMA max_page_count = 1", "PRAGMA max_page_count = 4294967294"), "is on a full disk"),
    "read-only": (("PRAGMA query_only = ON", "PRAGMA query_only = OFF"), "is read-only"),
}
"""Statements that make SQLite refuse and that end it, and its own words. The smallest number of pages is the file's."""


class Refusing:
    """Lets SQLite itself refuse to write while it is on."""

    def __init__(self, on: str, off: str) -> None:
        self.pragmas, self.is_on = {True: on, False: off}, False

    def __call__(self, connection: object, *_: object) -> None:
        connection.cursor().execute(self.pragmas[self.is_on])  # type: ignore[attr-defined]  # any driver's

    def switch(self, is_on: bool) -> None:
        self.is_on = is_on


def until(met: Callable[[], bool], seconds: float = 60) -> None:
    end = monotonic() + seconds
    while not met():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.02)


@contextmanager
def serving(sessions: sessionmaker[Session]) -> Iterator[None]:
    """Poller, worker and notifier."""
    stop = Signal()
    parts = (
        Poller(sessions, SETTINGS).run,
        Worker(sessions, CachedExecutor, SETTINGS, KINDS).run,
        Notifier(sessions, SETTINGS).run,
    )
    threads = [Thread(target=part, args=(stop,)) for part in parts]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        stop.set()
        for thread in threads:
            thread.join()


def watch(sessions: sessionmaker[Session], folder: Path, program: WebhookServer) -> None:
    now = datetime.now(UTC)
    with sessions.begin() as session:
        building = building_store.add(session, building_file("folder", str(folder)), folder, now)
        rule = ReceiverRule("program", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES)
        recipients.add(session, building.id, rule, "engineer", now)


def write(folder: Path, numbers: range) -> None:
    begin = datetime.now(UTC).replace(minute=0, second=0, microsecond=0) - timedelta(hours=12)
    for number in numbers:
        part = folder.parent / "part"
        part.write_bytes(miniseed(stream(begin + timedelta(hours=number), 20, seed=number)))
        part.rename(folder / f"{number}.mseed")


def delivered(sessions: sessionmaker[Session]) -> int:
    with reading(sessions)() as session:
        return list(session.scalars(select(Delivery.state))).count("delivered")


def count(sessions: sessionmaker[Session], table: type) -> int:
    with reading(sessions)() as session:
        return session.scalar(select(func.count()).select_from(table)) or 0


@pytest.mark.parametrize("database_kind", ["sqlite"], indirect=True)
@pytest.mark.parametrize("kind", REFUSALS)
def test_sqlite_refuses_writes_for_a_while(
    sessions: sessionmaker[Session], tmp_path: Path, kind: str, caplog: pytest.LogCaptureFixture
) -> None:
    pragmas, words = REFUSALS[kind]
    refusing = Refusing(*pragmas)
    event.listen(sessions.kw["bind"], "checkout", refusing)
    lose_nothing(sessions, tmp_path, refusing.switch, words, caplog)


@pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)
def test_postgresql_is_read_only_for_a_while(
    sessions: sessionmaker[Session], postgres: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    url = sessions.kw["bind"].url

    def switch(is_on: bool) -> None:
        databases.alter(postgres, url, f"SET default_transaction_read_only = {'on' if is_on else 'off'}")

    lose_nothing(sessions, tmp_path, switch, "is read-only; use the primary server, or allow writing", caplog)
    assert not [one for one in caplog.records if one.exc_info], "it was taken for a bug"
    with opened_client(url.render_as_string(hide_password=False)) as api:
        assert api.get("/api/v1/buildings").status_code == 200
        switch(True)
        assert api.get("/api/v1/buildings").status_code == 200
        answer = api.post("/api/v1/keys", json={"name": "tool", "role": "viewer"})
        assert (answer.status_code, answer.headers["Retry-After"]) == (503, "5")
        assert "cannot be written" in answer.json()["detail"]
        assert any("refused a request: " in line and "is read-only" in line for line in caplog.messages)


@pytest.fixture
def small_disk() -> Iterator[Path]:
    """A disk that PostgreSQL's user can reach, unlike pytest's folders."""
    with TemporaryDirectory(prefix="menshin-disk-") as folder:
        Path(folder).chmod(0o711)
        with small_disks.small_disk(Path(folder, "disk"), "192m") as disk:
            yield disk


def test_postgresql_has_its_tables_on_a_full_disk_for_a_while(
    postgres: str, small_disk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Its log of changes is on another disk: it refuses statements, and serves others."""
    with (
        databases.tablespace(postgres, small_disk / "tables") as place,
        databases.postgresql(postgres, tablespace=place) as url,
    ):
        lose_nothing_on(url, small_disk, tmp_path, caplog)


def test_postgresql_has_all_of_its_data_on_a_full_disk_for_a_while(
    small_disk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with databases.own_server(small_disk) as server:
        databases.prepare(server.get_uri())
        with databases.postgresql(server.get_uri()) as url:
            lose_nothing_on(url, small_disk, tmp_path, caplog)


def test_sqlite_is_on_a_full_disk_for_a_while(
    small_disk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Its log of changes and the index of that log are on the disk as well."""
    lose_nothing_on(databases.sqlite(small_disk), small_disk, tmp_path, caplog)


def test_poller_worker_and_notifier_all_find_sqlite_on_a_full_disk(
    small_disk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A file, an analysis and a message wait when the service starts; each is done once when there is room again."""
    made = opened.sessions(databases.sqlite(small_disk))
    folder = tmp_path / "records"
    folder.mkdir()
    poller = SourcePoller(made, SETTINGS)
    with webhook_server() as program, caplog.at_level(logging.WARNING):
        watch(made, folder, program)
        for number in range(3):
            write(folder, range(number, number + 1))
            if number < 2:
                poller.poll("TOWER")
                poller.queue_ready()
            if number < 1:
                Worker(made, CachedExecutor, SETTINGS, KINDS).run_until_idle()
                periodic_checks.check_buildings(made, SETTINGS, datetime.now(UTC), last={})
        assert [count(made, one) for one in (Recording, Analysis, Message, DeliveryAttempt)] == [2, 1, 1, 0]
        with closing(sqlite3.connect(small_disk / "menshin.sqlite")) as connection:
            connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # a write must make the log longer
        small_disks.fill(small_disk)
        with serving(made):
            until(lambda: {one.name for one in caplog.records if FULL in one.getMessage()} >= PARTS)
            assert [count(made, one) for one in (Recording, Analysis, Message, DeliveryAttempt)] == [2, 1, 1, 0]
            (small_disk / "filling").unlink()
            until(lambda: delivered(made) == 3)
    assert_once(made, program, 3)
    made.kw["bind"].dispose()
    assert not [one for one in caplog.records if one.exc_info], "it was taken for a bug"


def lose_nothing_on(url: str, disk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """As `lose_nothing` while the disk is full, and answers that only read are served meanwhile.

    The API keeps the connection it had: for a new one PostgreSQL may have to write a file, `pg_internal.init`, and
    refuses the connection if it cannot.
    """
    made = opened.sessions(url)
    with opened_client(url) as api:

        def is_served() -> None:
            answer = api.get("/api/v1/buildings")
            assert answer.status_code == 200, answer.text

        def switch(is_on: bool) -> None:
            is_served()
            if is_on:
                small_disks.fill(disk)
            else:
                (disk / "filling").unlink()

        try:
            lose_nothing(made, tmp_path, switch, FULL, caplog)
        finally:
            (disk / "filling").unlink(missing_ok=True)
            made.kw["bind"].dispose()
    assert not [one for one in caplog.records if one.exc_info], "it was taken for a bug"


def lose_nothing(
    sessions: sessionmaker[Session],
    tmp_path: Path,
    switch: Callable[[bool], None],
    words: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Poller, worker and notifier wait while writes are refused, say why, and then go on."""
    folder = tmp_path / "records"
    folder.mkdir()
    with webhook_server() as program, caplog.at_level(logging.WARNING):
        watch(sessions, folder, program)
        write(folder, range(FILES // 2))
        with serving(sessions):
            until(lambda: delivered(sessions) == FILES // 2)
            switch(True)
            write(folder, range(FILES // 2, FILES))
            until(lambda: any(words in line for line in caplog.messages))
            assert count(sessions, Recording) < FILES
            switch(False)
            until(lambda: delivered(sessions) == FILES)
    assert_once(sessions, program, FILES)


def assert_once(sessions: sessionmaker[Session], program: WebhookServer, files: int) -> None:
    """Each file was stored, analysed and reported once, and no attempt at it failed."""
    for table in (Recording, Event, Analysis, Message, Delivery, DeliveryAttempt):
        assert count(sessions, table) == files, table
    with reading(sessions)() as session:
        assert set(session.scalars(select(Recording.failures))) == {0}
    assert len({one.headers["webhook-id"] for one in program.posted}) == len(program.posted) == files
