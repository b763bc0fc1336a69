"""Files of a folder are taken once, when they have settled."""

import os
import socket
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from monitoring_server import SourceMemory

from service.records.sources.folder import Folder
from service.records.sources.source import SourceError

NOW = datetime(2024, 1, 1, tzinfo=UTC)


def write(file: Path, data: bytes, age: float) -> None:
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(data)
    os.utime(file, (NOW.timestamp() - age,) * 2)


def look(folder: Folder, cursor: dict[str, object], later: float = 0) -> tuple[list[bytes | None], dict[str, object]]:
    data: list[bytes | None] = []
    for step in folder.steps(cursor, NOW + timedelta(seconds=later)):
        data += [arrival.data for arrival in step.arrivals]
        cursor = dict(step.cursor)
        assert isinstance(folder.memory, SourceMemory)
        folder.memory.keep(step.files)
    return data, cursor


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path, max_bytes=1000, settle_time=2, memory=SourceMemory())


def test_each_file_once_and_again_when_it_changed(folder: Folder) -> None:
    write(folder.path / "a.mseed", b"a", 100)
    write(folder.path / "2024" / "b.mseed", b"b", 100)
    data, cursor = look(folder, {})
    assert data == [b"b", b"a"]
    assert look(folder, cursor)[0] == []
    write(folder.path / "a.mseed", b"aa", 50)
    assert look(folder, cursor)[0] == [b"aa"]


def test_a_file_that_grows_is_left_until_it_has_settled(folder: Folder) -> None:
    write(folder.path / "a.mseed", b"a", 1)
    data, cursor = look(folder, {})
    assert data == []
    write(folder.path / "a.mseed", b"aa", 10)  # old enough, but it has changed since the last look
    data, cursor = look(folder, cursor)
    assert data == []
    assert look(folder, cursor)[0] == [b"aa"]


def test_documents_and_hidden_files_are_no_records(folder: Folder) -> None:
    for name in ("building.toml", "README.md", "LICENSE", ".a.mseed.part"):
        write(folder.path / name, b"x", 100)
    assert look(folder, {})[0] == []


def test_a_file_too_large_is_not_read(folder: Folder) -> None:
    with (folder.path / "a.mseed").open("wb") as file:
        file.truncate(2 * 10**9)
    os.utime(folder.path / "a.mseed", (NOW.timestamp() - 100,) * 2)
    (step,) = folder.steps({}, NOW)
    assert step.arrivals[0].data is None
    assert "2000000000 bytes, 1000 are accepted" in (step.arrivals[0].refusal or "")


def test_a_folder_that_is_missing_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="does not exist; create it"):
        list(Folder(tmp_path / "gone", 1000, 2, SourceMemory()).steps({}, NOW))


def test_the_cursor_stays_small_however_many_files_were_taken(folder: Folder) -> None:
    for number in range(1200):
        write(folder.path / f"{number}.mseed", b"%d" % number, 100)
    data, cursor = look(folder, {})
    assert len(set(data)) == 1200
    assert len(str(cursor)) < 100
    assert look(folder, cursor)[0] == []


def test_a_file_that_grew_and_went_is_forgotten(folder: Folder) -> None:
    write(folder.path / "a.mseed", b"a", 1)
    _, cursor = look(folder, {})
    assert cursor["seen"]
    (folder.path / "a.mseed").unlink()
    assert look(folder, cursor)[1] == {"seen": {}}


def test_a_link_to_outside_is_refused_and_one_to_inside_followed(
    folder: Folder, tmp_path_factory: pytest.TempPathFactory
) -> None:
    outside = tmp_path_factory.mktemp("outside")
    write(outside / "secret", b"of another account", 100)
    write(folder.path / "records" / "a.mseed", b"a", 100)
    (folder.path / "inside.mseed").symlink_to(folder.path / "records" / "a.mseed")
    (folder.path / "outside.mseed").symlink_to(outside / "secret")
    (folder.path / "up.mseed").symlink_to("../" + outside.name + "/secret")
    (folder.path / "folder").symlink_to(outside)
    (folder.path / "nowhere.mseed").symlink_to(outside / "nothing")
    arrivals = {one.name: one for step in folder.steps({}, NOW) for one in step.arrivals}
    assert {name: one.data for name, one in arrivals.items()} == {
        "inside.mseed": b"a",
        "records/a.mseed": b"a",
        "outside.mseed": None,
        "up.mseed": None,
    }
    assert "is a symbolic link to outside the folder, which is not followed" in (arrivals["up.mseed"].refusal or "")


def test_a_folder_that_is_itself_a_link_is_followed(tmp_path: Path) -> None:
    write(tmp_path / "real" / "a.mseed", b"a", 100)
    (tmp_path / "link").symlink_to(tmp_path / "real")
    folder = Folder(tmp_path / "link", max_bytes=1000, settle_time=2, memory=SourceMemory())
    assert look(folder, {})[0] == [b"a"]


def test_pipes_and_sockets_are_not_read(folder: Folder) -> None:
    os.mkfifo(folder.path / "pipe.mseed")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(folder.path / "s.mseed"))
        (folder.path / "null.mseed").symlink_to("/dev/null")
        assert look(folder, {})[0] == []
