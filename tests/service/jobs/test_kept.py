"""Results that a worker keeps across a restart, in a folder of a limited size."""

import os
import pickle
import struct
import subprocess
import sys
from pathlib import Path
from time import time

import pytest

from service.jobs import kept as kept_module
from service.jobs.kept import DIGEST, LEFT, Kept, kept_in

RESULT = {"force": [1.0, 2.0]}


def test_a_result_outlives_its_worker(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    kept_in(folder, 10**6).add("one", RESULT)
    assert kept_in(folder, 10**6).find("one") == RESULT
    assert kept_in(folder, 10**6).find("two") is None
    assert (folder.stat().st_mode & 0o077, kept_in(folder, 0).folder) == (0, None)


def test_what_other_code_computed_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept_in(tmp_path / "kept", 10**6).add("one", RESULT)
    monkeypatch.setattr(kept_module, "_code", lambda: "of another version")
    assert kept_in(tmp_path / "kept", 10**6).find("one") is None


def test_those_not_used_for_longest_make_room(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    size = DIGEST + len(pickle.dumps(RESULT, pickle.HIGHEST_PROTOCOL))
    full = kept_in(folder, 2 * size)
    for number, key in enumerate(("first", "second")):
        full.add(key, RESULT)
        os.utime(full._path(folder, key), (number, number))
    kept_in(folder, 2 * size).find("first")
    full.add("third", RESULT)
    assert [Kept(folder, 2 * size).find(key) for key in ("first", "second", "third")] == [RESULT, None, RESULT]


@pytest.mark.parametrize("size", [0, 5, DIGEST, DIGEST + 5, -1])
def test_a_torn_file_is_computed_again(size: int, tmp_path: Path) -> None:
    full = kept_in(tmp_path / "kept", 10**6)
    full.add("one", RESULT)
    (file,) = (tmp_path / "kept").iterdir()
    file.write_bytes(file.read_bytes()[:size])
    assert kept_in(tmp_path / "kept", 10**6).find("one") is None
    assert not file.exists()


def test_a_number_that_changed_on_the_disk_is_not_believed(tmp_path: Path) -> None:
    full = kept_in(tmp_path / "kept", 10**6)
    full.add("one", RESULT)
    (file,) = (tmp_path / "kept").iterdir()
    before = file.read_bytes()
    at = before.index(struct.pack(">d", 2.0))
    file.write_bytes(before[:at] + struct.pack(">d", 3.0) + before[at + 8 :])
    assert pickle.loads(file.read_bytes()[DIGEST:]) == {"force": [1.0, 3.0]}
    assert kept_in(tmp_path / "kept", 10**6).find("one") is None


def test_a_link_to_a_file_of_others_is_not_followed(tmp_path: Path) -> None:
    full = kept_in(tmp_path / "kept", 10**6)
    full.add("one", RESULT)
    (file,) = (tmp_path / "kept").iterdir()
    file.rename(tmp_path / "elsewhere")
    file.symlink_to(tmp_path / "elsewhere")
    assert kept_in(tmp_path / "kept", 10**6).find("one") is None
    assert (tmp_path / "elsewhere").exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to another user")
def test_a_file_of_another_user_is_not_read(tmp_path: Path) -> None:
    full = kept_in(tmp_path / "kept", 10**6)
    full.add("one", RESULT)
    (file,) = (tmp_path / "kept").iterdir()
    os.chown(file, 65534, 65534)
    assert kept_in(tmp_path / "kept", 10**6).find("one") is None


def test_what_ended_processes_left_is_removed(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    full = kept_in(folder, 10**6)
    for name, age in (("old.new", 2 * LEFT), ("young.new", 0.0)):
        (folder / name).write_bytes(b"unfinished")
        os.utime(folder / name, (time() - age, time() - age))
    full.add("one", RESULT)
    assert {one.name for one in folder.iterdir() if one.suffix == ".new"} == {"young.new"}


def test_processes_add_and_remove_at_the_same_time(tmp_path: Path) -> None:
    """Each has room for two results, and removes those of the others."""
    code = (
        "import sys, logging; logging.basicConfig(); from pathlib import Path; from service.jobs.kept import kept_in\n"
        "kept = kept_in(Path(sys.argv[1]), 100_000)\n"
        "for number in range(150):\n"
        "    kept.add(f'{sys.argv[2]} {number}', bytes(40_000))\n"
        "    kept.latest.clear()\n"
        "    assert kept.find(f'{sys.argv[2]} {number}') in (None, bytes(40_000))\n"
        "assert kept.folder is not None\n"
    )
    running = [
        subprocess.Popen([sys.executable, "-c", code, tmp_path / "kept", name], stderr=subprocess.PIPE, text=True)
        for name in "abc"
    ]
    assert [(process.communicate(timeout=120)[1], process.returncode) for process in running] == [("", 0)] * 3
    assert sum(one.stat().st_size for one in (tmp_path / "kept").iterdir()) <= 100_000


def test_a_folder_that_others_write_to_is_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    kept_in(folder, 10**6).add("one", RESULT)
    folder.chmod(0o777)
    assert kept_in(folder, 10**6).find("one") is None
