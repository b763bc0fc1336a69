"""`menshin doctor` on a healthy installation and with each fault: it names the fault, ends in time, keeps secrets."""

import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

import databases
import pytest
from command import menshin
from monitoring_server import Page, building_file, monitoring_server
from receivers import mail_server
from sqlalchemy import text, update
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Role
from service.access.tables import ApiKey
from service.buildings import store as building_store
from service.db import process_leases
from service.db.process_leases import NOTIFYING, POLLING, POLLING_LEASE, WORKING
from service.db.sessions import engine
from service.demo.server import free_port
from service.doctor.examination import FURTHER, examine
from service.doctor.findings import Finding, State
from service.notify.housekeeping import LEASE
from service.records.source_poller import SourcePoller
from service.records.tables import SourceState
from service.settings import Settings

SECRET = "s3cret"
RECEIVER = """
[[receiver]]
name = "duty"
kind = "email"
address = "duty@example.org"
"""


@pytest.fixture(autouse=True)
def _own(own_settings: None) -> None:
    """No settings of the user who runs the test."""


def watch(sessions: sessionmaker[Session], folder: Path, source: str) -> None:
    with sessions.begin() as session:
        building_store.add(session, source + RECEIVER, folder, datetime.now(UTC))


def start(sessions: sessionmaker[Session]) -> None:
    """The leases that living processes hold, and an admin's key."""
    now = datetime.now(UTC)
    lengths = {POLLING: POLLING_LEASE, WORKING: timedelta(seconds=120), NOTIFYING: LEASE}
    with sessions.begin() as session:
        for name, length in lengths.items():
            process_leases.hold(session, name, "host:1", now, length)
        keys.create(session, "office", Role.admin, now)


def examination(url: str, timeout: float = 10.0, **other: object) -> tuple[Finding, ...]:
    given: dict[str, Any] = {"data_health": {"disk_reserve": 0}, "port": free_port(0)} | other
    return examine(Settings(database_url=url, **given), timeout)


def bad(findings: tuple[Finding, ...]) -> dict[str, str]:
    """Faults, by check; every fault comes with a remedy."""
    found = [one for one in findings if one.state in (State.WRONG, State.UNKNOWN)]
    assert all(one.helps for one in found)
    return {one.check: one.found for one in found}


def notes(findings: tuple[Finding, ...], check: str) -> list[str]:
    """Notes of one check. Each must come with a remedy."""
    found = [one for one in findings if one.state is State.NOTE and one.check == check]
    assert all(one.helps for one in found)
    return [one.found for one in found]


def test_a_healthy_installation(sessions: sessionmaker[Session], database_url: str, tmp_path: Path) -> None:
    with mail_server() as box, monitoring_server() as server:
        smtp = {"host": box.host, "port": box.port, "security": "none"}
        watch(sessions, tmp_path, building_file("fdsnws", server.address, 'data = "continuous"'))
        start(sessions)
        SourcePoller(sessions, Settings(polling={"retries": 0, "timeout": 5})).poll_all()
        findings = examination(database_url, smtp=smtp)
        assert bad(findings) == {}
        assert box.mails == []
        assert server.requested[-1][0] == "/fdsnws/dataselect/1/version"
    checks = dict.fromkeys(one.check for one in findings)
    assert tuple(checks) == ("settings", "database", *FURTHER)
    words = "\n".join(one.found for one in findings)
    assert "accepts mail from menshin@localhost; nothing was sent" in words
    assert "admins of all buildings: office" in words
    assert ("the clock of the database's server shows the same time" in words) == database_url.startswith("postgresql")


@pytest.mark.sqlite
def test_what_runs_nowhere_is_wrong(sessions: sessionmaker[Session], database_url: str, tmp_path: Path) -> None:
    watch(sessions, tmp_path, building_file("folder", str(tmp_path / "nowhere")))
    findings = examination(database_url)
    found = bad(findings)
    for process in ("poller", "worker", "notifier"):
        assert found[process] == f"no {process} was seen lately"
    assert found["mail"] == "no mail server is set, but 1 recipients get mail"
    assert (
        found["sources"]
        == f"the source of TOWER: the folder {tmp_path}/nowhere cannot be read: No such file or directory"
    )
    assert found["keys"] == "no key belongs to an admin of all buildings"


@contextmanager
def answering(answer: bytes | None) -> Iterator[int]:
    """A server that gives every connection this answer; with None it takes connections and stays silent."""
    with socket.create_server(("127.0.0.1", 0)) as door:

        def serve() -> None:
            while True:
                try:
                    connection, _ = door.accept()
                except OSError:
                    return
                with connection:
                    connection.recv(4096)
                    connection.sendall(answer or b"")

        if answer is not None:
            Thread(target=serve, daemon=True).start()
        yield door.getsockname()[1]
        door.shutdown(socket.SHUT_RDWR)


@pytest.mark.sqlite
def test_a_source_with_another_time(sessions: sessionmaker[Session], database_url: str, tmp_path: Path) -> None:
    answer = b"HTTP/1.1 200 OK\r\nDate: Mon, 01 Jan 2024 00:00:00 GMT\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
    with answering(answer) as port:
        watch(sessions, tmp_path, building_file("archive", f"http://127.0.0.1:{port}/"))
        assert "s behind this machine's" in bad(examination(database_url))["sources"]
    with sessions.begin() as session:
        session.add(SourceState(building_id=1, cursor={}, clock_ahead=-7200.0))
    found = bad(examination(database_url))["clock"]
    assert found == "the clocks of 1 of 1 monitoring servers differ; the worst is 7200 s behind this machine's"


@pytest.mark.sqlite
def test_nothing_hangs_and_no_record_is_missed(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    with answering(None) as port:
        source = building_file("archive", f"http://127.0.0.1:{port}/", 'data = "continuous"')
        watch(sessions, tmp_path, source)
        with sessions.begin() as session:
            session.execute(text("UPDATE building SET created_at = '2024-01-01 00:00:00.000000'"))
        begun = monotonic()
        findings = examination(database_url, 1.5, smtp={"host": "127.0.0.1", "port": port})
        assert monotonic() - begun < 10  # of 1.5 and 1.5 s; a silent server would be waited for half a minute
    words = {one.found for one in findings}
    assert bad(findings)["mail"] == "no answer within 1.5 s"
    assert "the source of TOWER: no answer within 0.9 s" in words
    assert "no usable record of TOWER has come ever" in words


@pytest.mark.sqlite
def test_a_live_stream_is_asked_for_a_connection(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    with answering(b"") as port:
        watch(sessions, tmp_path, building_file("seedlink", f"seedlink://127.0.0.1:{port}"))
        assert "sources" not in bad(examination(database_url))
    assert "no server listens at this port" in bad(examination(database_url))["sources"]


@pytest.mark.sqlite
def test_keys_that_end_soon_and_that_ended(sessions: sessionmaker[Session], database_url: str) -> None:
    now = datetime.now(UTC)
    with sessions.begin() as session:
        keys.create(session, "office", Role.admin, now, expires_at=now + timedelta(days=3, hours=1))
    notes = {one.found for one in examination(database_url) if one.state is State.NOTE}
    assert "the key 'office' ends in 3 days" in notes
    with sessions.begin() as session:
        session.execute(update(ApiKey).values(expires_at=now - timedelta(days=1)))
    assert bad(examination(database_url))["keys"] == "no key belongs to an admin of all buildings"


def test_a_database_of_an_earlier_version(sessions: sessionmaker[Session], database_url: str) -> None:
    with sessions.begin() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '0020_tables'"))
    found = bad(examination(database_url))
    assert found["database"].endswith("are not those of this version")
    assert found["the rest"] == "everything else needs the database"
    with sessions() as session:
        assert session.scalar(text("SELECT version_num FROM alembic_version")) == "0020_tables"


def test_a_server_that_may_lose_what_it_committed() -> None:
    with databases.own_server() as server:
        address = server.get_uri()
        databases.prepare(address, ())
        with databases.postgresql(address) as url:
            before = examination(url)
            databases.alter(address, url, "SET synchronous_commit = off")
            after = examination(url)
    assert notes(before, "database") == []
    assert notes(after, "database") == [
        "the database's server has synchronous_commit off: a crash can lose records and send messages twice"
    ]


@pytest.mark.sqlite
def test_a_database_that_is_locked_or_missing(database_url: str, tmp_path: Path) -> None:
    writer = engine(database_url)
    with writer.begin():
        found = bad(examination(f"{database_url}?timeout=0.1"))
        assert found["database"].endswith("is in use by another process, which has not released it")
    writer.dispose()
    missing = tmp_path / "missing.sqlite"
    assert bad(examination(f"sqlite:///{missing}"))["database"].endswith("does not exist yet")
    assert not missing.exists()


@pytest.mark.sqlite
def test_the_command_prints_no_secret(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monitoring_server() as server, mail_server() as box:
        server.pages["/data"] = Page(status=401)
        location = server.address.replace("http://", f"http://me:{SECRET}@") + "/data"
        watch(sessions, tmp_path, building_file("archive", location))
        given = {
            "DATABASE_URL": database_url,
            "SMTP__HOST": box.host,
            "SMTP__PORT": str(box.port),
            "SMTP__SECURITY": "none",
            "SMTP__USER": "me",
            "SMTP__PASSWORD": SECRET,
            "SECRET_KEY": SECRET,
            "HEARTBEAT__URL": f"https://beats.example.org/{SECRET}",
            "PRT": "8000",
            "COLUMNS": "500",
        }
        for name, value in given.items():
            monkeypatch.setenv(name if name == "COLUMNS" else f"MENSHIN_{name}", value)
        done, shown = menshin("doctor", "--json"), menshin("doctor")
    assert (done.exit_code, shown.exit_code) == (1, 1)
    assert SECRET not in done.output + shown.output
    document = json.loads(done.stdout)
    assert document["is_well"] is False
    found = {(one["check"], one["state"]): one for one in document["findings"]}
    assert "MENSHIN_PRT is not a setting" in found["settings", "note"]["found"]
    assert "MENSHIN_SECRET_KEY contains no key" in found["settings", "wrong"]["found"]
    assert "535 5.7.8" in found["mail", "wrong"]["found"]
    assert "answered 401" in str(document)
    assert "the user name or the password is missing or wrong" in shown.output


def test_a_server_that_is_away(monkeypatch: pytest.MonkeyPatch) -> None:
    url = f"postgresql://alice:{SECRET}@127.0.0.1:{free_port(0)}/menshin"
    monkeypatch.setenv("MENSHIN_DATABASE_URL", url)
    monkeypatch.setenv("COLUMNS", "300")
    done = menshin("doctor")
    assert done.exit_code == 1
    assert SECRET not in done.output
    assert "cannot be reached: no server listens there" in done.output


@pytest.mark.sqlite
def test_a_healthy_installation_ends_with_zero(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    watch(sessions, tmp_path, building_file("folder", str(tmp_path)))
    start(sessions)
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    monkeypatch.setenv("MENSHIN_DATA_HEALTH__DISK_RESERVE", "0")
    with mail_server() as box:
        for name, value in {"HOST": box.host, "PORT": box.port, "SECURITY": "none"}.items():
            monkeypatch.setenv(f"MENSHIN_SMTP__{name}", str(value))
        done = menshin("doctor")
    assert done.exit_code == 0, done.output
    only = menshin("doctor", "--only", "mail", "--only", "keys", "--json")
    assert only.exit_code == 1, "the mail server has ended"
    checks = [one["check"] for one in json.loads(only.stdout)["findings"]]
    assert list(dict.fromkeys(checks)) == ["settings", "database", "mail", "keys"]
    assert menshin("doctor", "--only", "post").exit_code == 2
