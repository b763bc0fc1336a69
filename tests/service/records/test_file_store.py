"""Original files in a folder and in a real S3-compatible server: whole, verified, and never lost."""

import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from datetime import timedelta
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
import s3_server
from monitoring_server import START, building_file, miniseed, stream
from processes import run
from pydantic import ValidationError
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.buildings import store as building_store
from service.db.sessions import reading
from service.errors import StoreAwayError
from service.records import originals
from service.records.file_store import UNFINISHED, FileStore, LostFileError
from service.records.source_poller import SourcePoller
from service.records.tables import Content, Event, Recording, SourceState
from service.settings import Settings
from service.settings.groups import Storage

NOW = START + timedelta(days=1)
DATA = b"original bytes"
DIGEST = sha256(DATA).hexdigest()


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Port of an S3-compatible server."""
    chosen = s3_server.free_port()
    with s3_server.s3_server(chosen):
        yield chosen


@pytest.fixture(params=["file", "s3"])
def given(request: pytest.FixtureRequest, tmp_path: Path) -> Mapping[str, Any]:
    """Settings of a store without files: a folder, and a prefix of a bucket."""
    if request.param == "file":
        (tmp_path / "originals").mkdir()
        return {"originals": f"file://{tmp_path}/originals"}
    return s3_server.settings(request.getfixturevalue("port"), f"/{tmp_path.name}")


def silent(doing: str, done: int, of: int) -> None:
    assert 0 < done <= of, doing


def as_variables(given: Mapping[str, str]) -> dict[str, str]:
    """Settings of [storage] in the environment."""
    return {f"MENSHIN_STORAGE__{name.upper()}": value for name, value in given.items()}


def poll(sessions: sessionmaker[Session], settings: Settings) -> bool:
    return SourcePoller(sessions, settings, clock=lambda: NOW).poll("TOWER")


def where(sessions: sessionmaker[Session]) -> list[tuple[bool, int]]:
    """For each original file: True if it is outside, and its bytes in the database."""
    with sessions() as session:
        rows = session.scalars(select(Content).options(undefer(Content.data)))
        return [(one.is_outside, len(one.data)) for one in rows]


def with_folder(sessions: sessionmaker[Session], folder: Path) -> None:
    """A building whose source is a folder with one file."""
    folder.mkdir()
    (folder / "a.mseed").write_bytes(miniseed(stream()))
    os.utime(folder / "a.mseed", (1, 1))
    with sessions.begin() as session:
        building_store.add(session, building_file("folder", str(folder)), Path("/"), NOW)


def test_what_is_put_can_be_got_again_and_deleted(given: Mapping[str, Any]) -> None:
    store = FileStore(Storage(**given))
    store.put(DIGEST, DATA)
    store.put(DIGEST, DATA)
    assert store.get(DIGEST) == DATA
    store.probe()
    assert store.digests() == {DIGEST}
    store.delete(DIGEST)
    store.delete(DIGEST)
    assert store.digests() == set()
    with pytest.raises(LostFileError, match=f"{DIGEST} is missing .* backup"):
        store.get(DIGEST)


def test_a_damaged_file_is_refused_and_mended_when_it_comes_again(given: Mapping[str, Any]) -> None:
    store = FileStore(Storage(**given))
    store.put(DIGEST, DATA[:-1])
    with pytest.raises(LostFileError, match="is damaged"):
        store.get(DIGEST)
    store.put(DIGEST, DATA)
    assert store.get(DIGEST) == DATA


def test_a_large_file_comes_back_whole(port: int, tmp_path: Path) -> None:
    data = os.urandom(2**20) * 101  # more than one part of an upload
    digest = sha256(data).hexdigest()
    store = FileStore(Storage(**s3_server.settings(port, "/large")))
    store.put(digest, data)
    assert store.get(digest) == data
    store.delete(digest)


WRITER = """
import sys
from hashlib import sha256
from service.records.file_store import FileStore
from service.settings.groups import Storage
store = FileStore(Storage(originals=sys.argv[1]))
data = b"x" * (200 << 20)
print(flush=True)
store.put(sha256(data).hexdigest(), data)
"""


def test_a_writer_that_is_killed_leaves_no_file_under_its_name(tmp_path: Path) -> None:
    folder = tmp_path / "originals"
    folder.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER, f"file://{folder}"], stdout=subprocess.PIPE, cwd=Path.cwd()
    )
    assert process.stdout is not None
    process.stdout.readline()
    while process.poll() is None and not list(folder.glob(f"*/*{UNFINISHED}")):
        time.sleep(0.001)
    process.kill()
    process.wait()
    process.stdout.close()
    left = [path.name for path in folder.rglob("*") if path.is_file()]
    assert left
    assert all(name.endswith(UNFINISHED) for name in left)
    store = FileStore(Storage(originals=f"file://{folder}"))
    assert store.sweep() == 0  # its writer may be alive
    for path in folder.glob(f"*/*{UNFINISHED}"):
        os.utime(path, (1, 1))
    assert store.sweep() == 1


def test_a_folder_that_is_not_there_is_not_made(tmp_path: Path) -> None:
    store = FileStore(Storage(originals=f"file://{tmp_path}/disk/originals"))
    for use in (lambda: store.put(DIGEST, DATA), lambda: store.get(DIGEST), store.probe):
        with pytest.raises(StoreAwayError, match="does not exist; make it"):
            use()
    assert not (tmp_path / "disk").exists()


def test_the_poller_keeps_bytes_in_the_store_and_reads_them_there(
    sessions: sessionmaker[Session], given: Mapping[str, Any], tmp_path: Path
) -> None:
    with_folder(sessions, tmp_path / "in")
    settings = Settings(storage=given)
    assert poll(sessions, settings)
    assert where(sessions) == [(True, 0)]
    with reading(sessions)() as session:
        assert [event.state for event in session.scalars(select(Event))] == ["queued"]
        recording = session.scalars(select(Recording)).one()
        assert originals.read(session, str(recording.sha256), settings.storage) == miniseed(stream())
        with pytest.raises(LostFileError, match=r"storage\.originals is not set"):
            originals.read(session, str(recording.sha256), Storage())


def test_a_poller_without_the_store_waits_says_so_and_loses_nothing(
    sessions: sessionmaker[Session], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, logger="service")
    with_folder(sessions, tmp_path / "in")
    port = s3_server.free_port()
    given = s3_server.settings(port, f"/{tmp_path.name}")
    settings = Settings(storage=given)
    for _ in range(5):  # more often than a file may fail to be read
        assert not poll(sessions, settings)
    with sessions() as session:
        state = session.scalars(select(SourceState)).one()
        assert state.failing_since == NOW
        assert f"store of original files, {given['originals']}, cannot be reached; check" in (state.error or "")
    assert where(sessions) == []
    with s3_server.s3_server(port):
        assert poll(sessions, settings)
        assert len(s3_server.names(port)) == 1
        with sessions.begin() as session:  # as if it had been stored, and not read
            session.execute(update(Recording).values(state="stored"))
    for _ in range(5):
        with pytest.raises(StoreAwayError):
            poll(sessions, settings)
    with sessions() as session:
        waiting = session.scalars(select(Recording)).one()
        assert (waiting.state, waiting.failures) == ("stored", 0)
    said = [one.message for one in caplog.records if one.name == "service.records.file_store"]
    assert [("cannot be reached" in one, "can be used again" in one) for one in said] == [
        (True, False),
        (False, True),
        (True, False),
    ]
    assert s3_server.SECRET not in caplog.text
    assert s3_server.ACCESS not in caplog.text


def test_a_store_that_stalls_is_given_up_in_time(port: int) -> None:
    own = s3_server.free_port()
    with s3_server.s3_server(own) as process:
        store = FileStore(Storage(**s3_server.settings(own), timeout=1.0))
        store.put(DIGEST, DATA)
        process.send_signal(signal.SIGSTOP)
        begun = time.monotonic()
        with pytest.raises(StoreAwayError, match="did not answer in time"):
            store.get(DIGEST)
        assert time.monotonic() - begun < 30.0  # ATTEMPTS of 1 s each, and pauses, on a busy machine
        process.send_signal(signal.SIGCONT)
        assert store.get(DIGEST) == DATA


def test_a_bucket_that_is_not_there_is_named(port: int) -> None:
    store = FileStore(Storage(**s3_server.settings(port) | {"originals": "s3://another"}))
    for use in (lambda: store.put(DIGEST, DATA), lambda: store.get(DIGEST)):
        with pytest.raises(StoreAwayError, match="s3://another, does not exist"):
            use()


@pytest.mark.parametrize(
    "originals",
    [
        "s3://key:hidden@bucket/a",
        "http://server/hidden",
        "file://hidden/a",
        "file:///",
        "s3:///hidden",
        "s3://b?hidden=1",
    ],
)
def test_addresses_that_name_no_store_are_refused(originals: str) -> None:
    with pytest.raises(ValidationError):
        Storage(originals=originals)


@pytest.mark.slow
def test_the_commands_move_files_out_and_in_and_find_lost_ones(
    sessions: sessionmaker[Session], database_url: str, given: Mapping[str, str], tmp_path: Path
) -> None:
    with_folder(sessions, tmp_path / "in")
    assert poll(sessions, Settings())
    size = len(miniseed(stream()))
    assert where(sessions) == [(False, size)]
    variables = as_variables(given)

    def command(*arguments: str) -> subprocess.CompletedProcess[str]:
        done = run(tmp_path, database_url, *arguments, **variables)
        assert s3_server.SECRET not in done.stdout + done.stderr
        assert s3_server.ACCESS not in done.stdout + done.stderr
        return done

    assert "storage.originals is not set" in run(tmp_path, database_url, "storage", "move", "--to-store").stderr
    assert "1 original files moved" in command("storage", "move", "--to-store").stdout
    assert where(sessions) == [(True, 0)]
    assert "0 original files moved" in command("storage", "move", "--to-store").stdout
    assert "1 original files in the store are whole" in command("storage", "check").stdout
    assert "has 1 original files" in command("doctor", "--only", "storage", "--json").stdout
    unset = run(tmp_path, database_url, "doctor", "--only", "storage", "--json").stdout
    assert "1 original files are outside the database, but storage.originals is not set" in unset
    if database_url.startswith("sqlite"):
        saved = command("backup", str(tmp_path / "copy.sqlite"))
        assert f"are in {given['originals']}, not in this copy" in saved.stderr
    assert command("building", "export", "TOWER", str(tmp_path / "tower.zip")).returncode == 0
    store = FileStore(Storage(**given))
    with sessions() as session:
        digest = session.scalars(select(Content.sha256)).one()
    data = store.get(digest)
    store.delete(digest)
    lost = command("storage", "check")
    assert lost.returncode == 1
    assert f"{digest} is missing" in lost.stderr
    refused = command("building", "export", "TOWER", str(tmp_path / "again.zip"))
    assert (refused.returncode, f"{digest} is missing" in refused.stderr) == (1, True)
    assert not (tmp_path / "again.zip").exists()
    store.put(digest, data)
    assert "1 original files moved to the database" in command("storage", "move", "--to-database").stdout
    assert where(sessions) == [(False, size)]


def test_settings_with_keys_are_shown_without_them(tmp_path: Path, port: int) -> None:
    variables = as_variables(s3_server.settings(port))
    shown = run(tmp_path, f"sqlite:///{tmp_path}/menshin.sqlite", "settings", **variables)
    assert "s3://" in shown.stdout
    assert s3_server.SECRET not in shown.stdout
    assert s3_server.ACCESS not in shown.stdout


def test_a_move_that_is_ended_goes_on_where_it_was(
    sessions: sessionmaker[Session], given: Mapping[str, Any], tmp_path: Path
) -> None:
    settings = Storage(**given)
    files = [bytes([number]) * 100 for number in range(5)]
    with sessions.begin() as session:
        for one in files:
            originals.add(session, originals.secured(one, Storage()))

    def stop(doing: str, done: int, of: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        originals.move(sessions, settings, stop, to_store=True)
    assert sorted(where(sessions)) == [(False, 100)] * 3 + [(True, 0)] * 2
    assert originals.move(sessions, settings, silent, to_store=True) == originals.Outside(3, 300)
    assert originals.check(sessions, settings, silent) == []
    with reading(sessions)() as session:
        for one in files:
            assert originals.read(session, sha256(one).hexdigest(), settings) == one
