"""Commands take analyses of earlier commands from the user's cache folder, as processes of their own."""

import subprocess
from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from paper_records import building_file, miniseed, records
from processes import run

KEPT = "kept by an earlier command"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two earthquakes of 60 s at the paper's building, and a model of it."""
    made = tmp_path_factory.mktemp("kept")
    (made / "building.toml").write_text(building_file(), "utf-8")
    samples = {name: series[:6000] for name, series in records(np.random.default_rng(7)).items()}
    (made / "event.mseed").write_bytes(miniseed(samples))
    (made / "later.mseed").write_bytes(miniseed(samples, timedelta(hours=1)))
    done = menshin(made, "model", "new", "--building", "building.toml", "-o", "model.toml")
    assert done.returncode == 0, done.stderr
    return made


def menshin(folder: Path, *arguments: str, room: str = "1.0") -> subprocess.CompletedProcess[str]:
    own = {"XDG_CACHE_HOME": str(folder / "cache"), "MENSHIN_JOBS__KEPT_ROOM": room}
    return run(folder, f"sqlite:///{folder / 'unused.sqlite'}", *arguments, **own)


def analysed(*files: str) -> Sequence[str]:
    return ("analyse", *files, "--building", "building.toml", "--json", "result.json")


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "cache" / "menshin" / "analyses").iterdir())


@pytest.mark.slow
def test_an_analysis_is_computed_once_for_all_commands(folder: Path) -> None:
    off = menshin(folder, *analysed("event.mseed"), room="0")
    result = (folder / "result.json").read_text("utf-8")
    first = menshin(folder, *analysed("event.mseed"))
    assert (off.returncode, first.returncode, KEPT in off.stderr + first.stderr) == (0, 0, False), first.stderr
    (file,) = kept(folder)
    assert file.stat().st_mode & 0o077 == 0
    second = menshin(folder, *analysed("event.mseed"))
    assert f"1 analysis was {KEPT} in {file.parent}\n" == second.stderr
    assert (off.stdout, result) == (second.stdout, (folder / "result.json").read_text("utf-8"))

    compared = ("model", "compare", "model.toml", "event.mseed", "later.mseed", "--building", "building.toml")
    assert f"1 analysis was {KEPT}" in menshin(folder, *compared).stderr
    assert f"2 analyses were {KEPT}" in menshin(folder, *compared).stderr

    file.write_bytes(damaged(file.read_bytes()))
    again = menshin(folder, *analysed("event.mseed"))
    assert "it is damaged" in again.stderr
    assert KEPT not in again.stderr
    assert (again.stdout, result) == (off.stdout, (folder / "result.json").read_text("utf-8"))
    assert KEPT in menshin(folder, *analysed("event.mseed")).stderr


def damaged(written: bytes) -> bytes:
    """One bit of a number is flipped: the pickle can still be read."""
    middle = len(written) // 2
    return b"".join((written[:middle], bytes([written[middle] ^ 1]), written[middle + 1 :]))
