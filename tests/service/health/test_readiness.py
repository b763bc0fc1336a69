"""The service says that it is ready, and its heart beats, as long as looks and analyses are really done."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import databases
import pytest
import small_disks
from api_client import client
from monitoring_server import building_file
from receivers import WebhookServer, webhook_server
from sqlalchemy import event, update
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db import process_leases, sessions as opened
from service.db.process_leases import POLLING, POLLING_LEASE, WORKING
from service.health import readiness
from service.jobs import queue as job_queue
from service.jobs.tables import Job, Lease
from service.notify.housekeeping import Housekeeping
from service.records.source_poller import SourcePoller
from service.records.tables import Event, SourceState
from service.settings import Settings

NOW = datetime.now(UTC)
GIVEN = {
    "poll_interval": 60,
    "http_retries": 3,
    "http_timeout": 30,
    "lease": 120,
    "worker_patience": 600,
    "disk_reserve": 0,
}
SETTINGS = Settings(**GIVEN)
LATE = timedelta(seconds=3 * 60 + 4 * 30)
"""Without a look, after which the sources of these settings count as not looked at."""
MIB = 2**20


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A database with a building that is watched through a folder."""
    folder = tmp_path_factory.mktemp("readiness")
    made = databases.sqlite(folder)
    with opened.sessions(made).begin() as session:
        building_store.add(session, building_file("folder", str(folder)), folder, NOW - timedelta(days=1))
    return made


@pytest.fixture
def sessions(url: str) -> Iterator[sessionmaker[Session]]:
    """Everything is as it has to be: poller and worker live, and the source was looked at just now."""
    made = opened.sessions(url)
    with made.begin() as session:
        for table in (Job, Event, Lease):
            session.query(table).delete()
        for right, length in ((POLLING, POLLING_LEASE), (WORKING, timedelta(seconds=SETTINGS.jobs.lease))):
            process_leases.hold(session, right, "host:1", datetime.now(UTC), length)
    SourcePoller(made, SETTINGS).poll_all()
    yield made
    made.kw["bind"].dispose()


def answered(url: str, **other: float) -> tuple[int, dict[str, dict[str, Any]]]:
    """Status of /readyz, and its checks by name."""
    given = {"poll_interval": 60, "worker_patience": 600, "disk_reserve": 0} | other
    with client(url, **given) as api:
        answer = api.get("/readyz")
    return answer.status_code, {one["name"]: one for one in answer.json()["checks"]}


def failing(url: str, **other: float) -> list[str]:
    status, checks = answered(url, **other)
    found = [name for name, one in checks.items() if not one["ok"]]
    assert status == (503 if found else 200)
    assert all(one["helps"] and one["since"] for one in checks.values() if not one["ok"])
    return found


def looked(sessions: sessionmaker[Session], at: datetime) -> None:
    with sessions.begin() as session:
        session.execute(update(SourceState).values(looked_at=at))


def test_all_is_checked_and_nothing_lacks(url: str, sessions: sessionmaker[Session]) -> None:
    status, checks = answered(url)
    assert status == 200
    assert list(checks) == ["database", "disk", "clock", "poller", "looks", "worker"]
    assert all(one["ok"] and one["since"] is None for one in checks.values())


def test_a_poller_that_lives_but_does_not_look_is_not_ready(url: str, sessions: sessionmaker[Session]) -> None:
    looked(sessions, datetime.now(UTC) - 0.9 * LATE)
    assert failing(url) == []
    looked(sessions, (late := datetime.now(UTC) - 1.1 * LATE))
    assert failing(url) == ["looks"]
    since = answered(url)[1]["looks"]["since"]
    assert abs(datetime.fromisoformat(since) - late) < timedelta(milliseconds=1)
    with sessions.begin() as session:
        session.execute(update(SourceState).values(failing_since=NOW))
    assert failing(url) == [], "a source that fails rests"
    SourcePoller(sessions, SETTINGS).poll_all()
    assert failing(url) == []


def test_a_building_without_a_source_lacks_no_look(url: str, sessions: sessionmaker[Session], tmp_path: Path) -> None:
    text = building_file("folder", str(tmp_path)).replace('"TOWER"', '"BARE"')
    bare = text[: text.index("[source]")] + text[text.index("[[channel]]") :]
    with sessions.begin() as session:
        building_store.add(session, bare, Path("/"), NOW - timedelta(days=1))
    assert failing(url) == []
    with sessions.begin() as session:
        building_store.update_description(session, text, Path("/"), NOW - timedelta(hours=1))
    assert failing(url) == ["looks"]
    SourcePoller(sessions, SETTINGS).poll_all()
    assert failing(url) == []


def test_sources_that_were_looked_at_are_late_without_reading_their_descriptions(
    url: str, sessions: sessionmaker[Session], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = building_file("folder", str(tmp_path)).replace('"TOWER"', '"GONE"')
    bare = text[: text.index("[source]")] + text[text.index("[[channel]]") :]
    with sessions.begin() as session:
        building_store.add(session, text, Path("/"), NOW - timedelta(days=1))
    SourcePoller(sessions, SETTINGS).poll_all()
    looked(sessions, datetime.now(UTC) - 1.1 * LATE)
    read: list[int] = []
    parsed = building_store.parsed
    monkeypatch.setattr(readiness.building_store, "parsed", lambda one: read.append(one.building_id) or parsed(one))
    before = late(sessions)
    assert before > 1
    assert read == []
    with sessions.begin() as session:
        building_store.update_description(session, bare, Path("/"), datetime.now(UTC) - 1.05 * LATE)
    read.clear()
    assert late(sessions) == before - 1
    assert len(read) == 1
    with sessions.begin() as session:
        building_store.update_description(session, text, Path("/"), datetime.now(UTC))


def late(sessions: sessionmaker[Session]) -> int:
    """Number of sources that were not looked at in time."""
    with sessions() as session:
        checks = readiness.checks(session, SETTINGS, datetime.now(UTC))
    number = next(one.found for one in checks if one.name == "looks").split()[0]
    return 1 if number == "one" else int(number)


def test_late_sources_take_as_many_statements_for_two_buildings_as_for_five(
    url: str, sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    numbers, found = [], []
    for codes in ("AB", "CDE"):
        with sessions.begin() as session:
            for code in codes:
                text = building_file("folder", str(tmp_path)).replace('"TOWER"', f'"{code}"')
                building_store.add(session, text, Path("/"), NOW - timedelta(days=1))
        statements: list[object] = []

        def note(*given: object) -> None:
            statements.append(given[2])  # noqa: B023  removed before the next round

        event.listen(sessions.kw["bind"], "before_cursor_execute", note)
        with sessions() as session:
            found += [
                one.found for one in readiness.checks(session, SETTINGS, datetime.now(UTC)) if one.name == "looks"
            ]
        event.remove(sessions.kw["bind"], "before_cursor_execute", note)
        numbers.append(len(statements))
    assert numbers[0] == numbers[1]
    assert [one.split()[0] for one in found] == ["2", "5"]


def test_a_clock_that_was_set_back_is_not_ready_until_looks_have_its_time(
    url: str, sessions: sessionmaker[Session]
) -> None:
    looked(sessions, datetime.now(UTC) + timedelta(hours=2))
    assert failing(url) == ["clock"]
    assert re.search(r" 7[12]\d\d s later", answered(url)[1]["clock"]["found"])
    SourcePoller(sessions, SETTINGS).poll_all()
    assert failing(url) == []


def test_work_that_waits_without_progress_is_not_ready(url: str, sessions: sessionmaker[Session]) -> None:
    long_ago = datetime.now(UTC) - timedelta(seconds=1.1 * SETTINGS.data_health.worker_timeout)
    with sessions.begin() as session:
        building = session.query(Building).first()
        assert building is not None
        times = {"start": NOW, "end": NOW, "created_at": NOW, "updated_at": NOW}
        session.add(event := Event(building_id=building.id, state="gathering", **times))
        session.flush()
        job_queue.enqueue(session, event, {}, long_ago)
    assert failing(url) == ["worker"]
    assert failing(url, worker_patience=3600) == []
    with sessions.begin() as session:
        session.add(Job(kind="watch", arguments={}, state="done", created_at=NOW, finished_at=datetime.now(UTC)))
    assert failing(url) == [], "a long queue that moves is no fault"


def test_the_heart_beats_only_while_all_that_holds(url: str, sessions: sessionmaker[Session]) -> None:
    with webhook_server() as there:
        there.status = 200
        assert beats(there, sessions) == 1
        looked(sessions, datetime.now(UTC) - 1.1 * LATE)
        assert beats(there, sessions) == 0
        looked(sessions, datetime.now(UTC))
        assert beats(there, sessions) == 1
        assert beats(there, sessions, disk_reserve=2**62) == 0, "no disk has as much room"


def beats(there: WebhookServer, sessions: sessionmaker[Session], **other: float) -> int:
    """Number of outside requests of a notifier that does what is due now."""
    before = len(there.posted)
    given = GIVEN | {"heartbeat_url": f"{there.address}/ping"} | other
    Housekeeping(sessions, Settings(**given)).step()
    return len(there.posted) - before


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 32 MiB of its own."""
    with small_disks.small_disk(tmp_path / "disk", "32m") as folder:
        yield folder


def test_a_full_disk_is_not_ready_until_it_has_room(small_disk: Path) -> None:
    url = databases.sqlite(small_disk)
    sessions = opened.sessions(url)
    with sessions.begin() as session:
        for right in (POLLING, WORKING):
            process_leases.hold(session, right, "host:1", datetime.now(UTC), POLLING_LEASE)
    reserve = 20 * 8 * MIB  # so that 8 MiB have to be free
    assert failing(url, disk_reserve=reserve) == []
    filling = small_disks.fill(small_disk, MIB)
    assert failing(url, disk_reserve=reserve) == ["disk"]
    filling.unlink()
    assert failing(url, disk_reserve=reserve) == []
    sessions.kw["bind"].dispose()
