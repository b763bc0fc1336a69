"""`menshin model fit` by the front door: values with their deviations, and what records cannot determine."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from command import menshin
from hidden.trial import Trial

from core.model.isolator import Isolator
from service.models.model_file import ModelFile, read, written
from tests.service.models.conftest import without_the_hidden

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]


@dataclass(frozen=True)
class Fitted:
    text: str
    model: ModelFile
    document: dict[str, Any]


@pytest.fixture(scope="module")
def fitted(folder: Path) -> Fitted:
    """From values that are all 20 % off, to the earthquakes that do not reach the wall; the first is left out."""
    start = read((folder / "model.toml").read_text("utf-8"))
    off = {
        name: {key: value * (1.2 if key in ("k_b", "c_b", "F_y", "D_y") else 1.0) for key, value in values.items()}
        for name, values in start.isolator.effects.items()
    }
    (folder / "off.toml").write_text(written(ModelFile("TRIAL", "x", Isolator(off))), "utf-8")
    files = (folder / "event2.mseed", folder / "event4.mseed", "--hold-out", folder / "event1.mseed")
    out = ("-o", folder / "fitted.toml", "--json", folder / "fitted.json")
    done = menshin("model", "fit", folder / "off.toml", *files, "--building", folder / "building.toml", *out)
    assert done.exit_code == 0, done.output
    return Fitted(
        " ".join(done.output.split()),
        read((folder / "fitted.toml").read_text("utf-8")),
        json.loads((folder / "fitted.json").read_text("utf-8")),
    )


def test_the_values_are_the_true_ones(fitted: Fitted, moat: Trial) -> None:
    """Within 4 standard deviations, or 2 % of k_b and 10 % of F_y for what errs in the superstructure."""
    true = without_the_hidden(moat)
    for effect, parameter, rel in (("elastic", "k_b", 0.02), ("bouc_wen", "F_y", 0.1)):
        value, std = (
            fitted.model.isolator.effects[effect][parameter],
            fitted.model.standard_deviations[effect][parameter],
        )
        assert value == pytest.approx(true.effects[effect][parameter], abs=4 * std, rel=rel)
        assert 0 < std < 0.1 * value


def test_the_file_names_its_parent_and_reference(fitted: Fitted) -> None:
    assert fitted.model.parent == "off.toml"
    assert fitted.model.reference is not None
    assert len(fitted.model.fitted_to) == 2
    assert set(fitted.model.standard_deviations["bouc_wen"]) == {"F_y", "D_y", "beta"}  # the others are held


def test_the_error_falls_where_it_was_fitted_and_where_not(fitted: Fitted) -> None:
    pairs = list(zip(fitted.document["before"], fitted.document["after"], strict=True))
    assert [before["held_out"] for before, _ in pairs] == [True, False, False]
    for before, after in pairs:
        assert after["force"]["rms"] < 0.5 * before["force"]["rms"]
        assert after["prediction"]["displacement"]["nrmse"] < 0.5 * before["prediction"]["displacement"]["nrmse"]
    assert re.search(
        r"changes from [\d.]+ % to [\d.]+ % where it was fitted and from [\d.]+ % to [\d.]+ % on held-out", fitted.text
    )


def test_the_covariance_is_that_of_the_deviations(fitted: Fitted) -> None:
    """1 %: three digits of the deviations are written."""
    covariance = fitted.document["covariance"]
    for row, (effect, parameter) in enumerate(covariance["parameters"]):
        std = covariance["matrix"][row][row] ** 0.5
        assert fitted.model.standard_deviations[effect][parameter] == pytest.approx(std, rel=0.01)


def test_the_outcome_is_stated_in_words(fitted: Fitted) -> None:
    assert fitted.document["outcome"] == "settled"
    assert "Fitted: the misfit has a minimum here." in fitted.text


def test_what_no_record_excites_is_stated(folder: Path, tmp_path: Path) -> None:
    """The layer stays 30 mm away from this wall."""
    start = read((folder / "model.toml").read_text("utf-8"))
    wall = {"gap": 0.05, "gap_back": 0.05, "wall": 1e8, "wall_back": 1e8}
    walled = ModelFile("TRIAL", "x", Isolator({**start.isolator.effects, "moat": wall}))
    (tmp_path / "walled.toml").write_text(written(walled), "utf-8")
    arguments = ("walled.toml", folder / "event2.mseed", "--building", folder / "building.toml", "-o", "out.toml")
    done = menshin("model", "fit", *arguments)
    assert done.exit_code == 0, done.output
    text = " ".join(done.output.split())
    assert "Fitted in part: the records do not determine every parameter." in text
    assert re.search(r"Not determined: [^.]*wall of moat", text)
    assert "No earthquake was held out" in text
    assert set(read(Path("out.toml").read_text("utf-8")).standard_deviations["moat"].values()) == {float("inf")}


def test_an_earthquake_cannot_be_both_fitted_and_held_out(folder: Path) -> None:
    twice = (folder / "event1.mseed", "--hold-out", folder / "event1.mseed")
    arguments = (folder / "model.toml", *twice, "--building", folder / "building.toml", "-o", "out.toml")
    done = menshin("model", "fit", *arguments)
    assert done.exit_code == 1
    assert "is held out, and also among the others" in " ".join(done.output.split())
