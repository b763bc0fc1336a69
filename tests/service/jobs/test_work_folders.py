"""Temporary folders are removed by who made them, or by the next one where that was killed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from service import roles

MAKES = """
from service.roles import process_folder
with process_folder() as folder:
    print(folder, flush=True)
    input()
"""
COMMAND = [sys.executable, "-c", MAKES]


@pytest.fixture
def temporary(tmp_path: Path) -> dict[str, str]:
    """The environment of processes whose temporary folders come into one of the test's own."""
    return os.environ | {"TMPDIR": str(tmp_path)}


def left(folder: Path) -> list[str]:
    return sorted(one.name for one in folder.iterdir())


def test_a_folder_goes_with_its_process_or_with_the_next(tmp_path: Path, temporary: dict[str, str]) -> None:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "env": temporary}
    for name in ("other", "menshin-postgres-x"):
        (tmp_path / name).mkdir()
    with subprocess.Popen(COMMAND, **pipes) as first, subprocess.Popen(COMMAND, **pipes) as second:  # type: ignore[call-overload]
        of_first, of_second = (Path(one.stdout.readline().strip()) for one in (first, second))
        assert of_first.is_dir()
        assert of_second.is_dir()
        first.kill()
        first.wait()
        assert of_first.is_dir(), "the killed one could not remove it"
        done = subprocess.run(COMMAND, input="\n", capture_output=True, text=True, env=temporary, check=True)
        assert not of_first.exists()
        assert not Path(done.stdout.strip()).exists()
        assert of_second.is_dir(), "a living process keeps its own"
        second.communicate("\n")
    assert left(tmp_path) == ["menshin-postgres-x", "other"]


def test_a_folder_without_a_lock_is_left_as_long_as_its_process_may_be_about_to_lock_it(
    tmp_path: Path, temporary: dict[str, str]
) -> None:
    young, old = (tmp_path / f"{roles.WORK_FOLDER}{name}" for name in ("young", "old"))
    young.mkdir()
    old.mkdir()
    os.utime(old, (0, 0))
    subprocess.run(COMMAND, input="\n", capture_output=True, text=True, env=temporary, check=True)
    assert left(tmp_path) == [young.name]
