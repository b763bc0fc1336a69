"""`menshin model sketch` by the front door: a moat that the model lacks, as formula, page, JSON and effect."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from command import menshin
from few_effects import few_effects

from core import effects

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]


@pytest.fixture
def own_library() -> Iterator[None]:
    """Only the effects of the model, and those that a test adds."""
    with few_effects():
        yield


@pytest.mark.usefixtures("own_library")
def test_a_force_that_the_model_lacks_becomes_a_file_that_runs(folder: Path, tmp_path: Path) -> None:
    given = [folder / f"event{number}.mseed" for number in (1, 2, 3, 4)]
    out = ("-o", tmp_path / "wall.py", "--json", tmp_path / "s.json", "--html", tmp_path / "s.html")
    own = ("--building", folder / "building.toml", "--hold-out", folder / "event5.mseed", *out)
    done = menshin("model", "sketch", folder / "model.toml", *given, *own)
    assert done.exit_code == 0, done.output
    shown = " ".join(done.output.split())
    assert "Proposed: " in shown
    document = json.loads((tmp_path / "s.json").read_text("utf-8"))
    assert document["dependences"][0]["variable"] == "displacement"
    assert document["proposal"]["taken"]["all fitted"] > 0.5
    source = (tmp_path / "wall.py").read_text("utf-8")
    assert source == document["proposal"]["source"]
    assert "<svg" in (tmp_path / "s.html").read_text("utf-8")
    first = document["missing"][0]
    assert len(first["time"]) == len(first["force"]) == len(first["std"])
    names: dict[str, object] = {}
    exec(compile(source, "wall.py", "exec"), names)
    assert isinstance(names["EFFECT"], effects.Effect)


@pytest.mark.parametrize("name", ["two words.py", "hardening.py", "wall.txt"])
def test_a_name_that_no_effect_can_have_is_refused(folder: Path, tmp_path: Path, name: str) -> None:
    records = (folder / "event1.mseed", "--building", folder / "building.toml")
    done = menshin("model", "sketch", folder / "model.toml", *records, "-o", tmp_path / name)
    assert done.exit_code == 2
    assert "unused name" in " ".join(done.output.replace("│", "").split())
    assert not (tmp_path / name).exists()
