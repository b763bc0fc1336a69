"""Results that a worker keeps across a restart, in a folder of a limited size."""

import os
import pickle
from pathlib import Path

import pytest

from service.jobs import kept as kept_module
from service.jobs.kept import Kept, kept_in

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
    size = len(pickle.dumps(RESULT, pickle.HIGHEST_PROTOCOL))
    full = kept_in(folder, 2 * size)
    for number, key in enumerate(("first", "second")):
        full.add(key, RESULT)
        os.utime(full._path(folder, key), (number, number))
    kept_in(folder, 2 * size).find("first")
    full.add("third", RESULT)
    assert [Kept(folder, 2 * size).find(key) for key in ("first", "second", "third")] == [RESULT, None, RESULT]


def test_a_torn_file_is_computed_again(tmp_path: Path) -> None:
    full = kept_in(tmp_path / "kept", 10**6)
    full.add("one", RESULT)
    (file,) = (tmp_path / "kept").iterdir()
    file.write_bytes(file.read_bytes()[:5])
    assert kept_in(tmp_path / "kept", 10**6).find("one") is None
    assert not file.exists()


def test_a_folder_that_others_write_to_is_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    kept_in(folder, 10**6).add("one", RESULT)
    folder.chmod(0o777)
    assert kept_in(folder, 10**6).find("one") is None
