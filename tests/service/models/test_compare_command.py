"""`menshin model compare` by the front door: text, JSON and page of one model held against two earthquakes."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from command import menshin
from hidden.trial import Trial
from markupsafe import escape

from service.models.model_file import read

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]


@dataclass(frozen=True)
class Compared:
    text: str
    document: dict[str, Any]
    page: str


@pytest.fixture(scope="module")
def compared(folder: Path) -> Compared:
    files = (folder / "event2.mseed", folder / "event3.mseed")
    out = ("--json", folder / "out" / "c.json", "--html", folder / "out" / "c.html")
    done = menshin("model", "compare", folder / "model.toml", *files, "--building", folder / "building.toml", *out)
    assert done.exit_code == 0, done.output
    return Compared(
        " ".join(done.output.split()),
        json.loads((folder / "out" / "c.json").read_text("utf-8")),
        (folder / "out" / "c.html").read_text("utf-8"),
    )


def test_the_failure_lies_where_the_layer_meets_the_wall(compared: Compared, moat: Trial) -> None:
    """Within 5 mm of the gap, or beyond it in the cycles that meet the wall: both have about the same odds."""
    ((_, values),) = moat.hidden
    regions = {one["covariate"]: one for one in compared.document["failure"]["regions"]}
    assert next(iter(regions)) in ("amplitude", "largest past displacement")
    for circumstance in ("amplitude", "largest past displacement"):
        assert regions[circumstance]["is_above"]
        assert regions[circumstance]["threshold"] > values["gap"] - 5e-3
    assert regions["largest past displacement"]["share"]["value"] > 0.9
    assert not compared.document["failure"]["is_noise"]


def test_the_weak_earthquake_is_noise_and_the_strong_one_is_not(compared: Compared) -> None:
    """Noise ratio 2: the noise of an estimated force is itself an estimate."""
    weak, strong = (event["force"]["noise_ratio"] for event in compared.document["events"])
    assert weak < 2 < strong


def test_errors_hang_together(compared: Compared) -> None:
    for event in compared.document["events"]:
        force = event["force"]
        assert force["rms"] == pytest.approx(force["noise_ratio"] * force["noise_floor"])
        assert force["fitting_rate"] == pytest.approx(100 * (1 - force["nrmse"]), abs=0.5)  # but for the mean
        assert list(event["prediction"]["accelerations"]) == ["1F", "4F", "RF"]
    every = compared.document["all"]["force"]["rms"] ** 2
    assert every == pytest.approx(sum(e["force"]["rms"] ** 2 for e in compared.document["events"]) / 2)


def test_the_weak_earthquake_is_predicted_from_the_ground_alone(compared: Compared) -> None:
    """3 %: of it the superstructure's identification makes up the most, at 3 % noise."""
    weak, strong = (event["prediction"]["displacement"]["nrmse"] for event in compared.document["events"])
    assert weak < 0.03 < strong


def test_the_text_is_in_the_engineers_units(compared: Compared) -> None:
    error = compared.document["all"]["force"]["rms"] / 1e3
    assert f"{error:.0f} kN (root mean square)" in compared.text
    assert compared.document["failure"]["explanation"] in compared.text
    for unit in (" kN ", " mm, ", " gal, ", " % "):
        assert unit in compared.text


def test_the_document_is_json_without_nan(folder: Path, compared: Compared) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    assert json.loads((folder / "out" / "c.json").read_text("utf-8"), parse_constant=refuse) == compared.document
    model = read((folder / "model.toml").read_text("utf-8"))
    assert compared.document["model"]["effects"] == {name: dict(v) for name, v in model.isolator.effects.items()}


def test_the_page_needs_nothing_else(compared: Compared) -> None:
    assert not re.search(r"(src|href)=|<script|@import|url\((?!#)", compared.page)
    for key in ("stiffness", "loop", "motion", "where", "spectrum", "histories"):
        assert f'<figure id="{key}">' in compared.page
    named = re.findall(r' id="([^"]+)"', compared.page)
    assert len(named) == len(set(named))
    assert compared.page.count('<svg role="img" aria-label="') == compared.page.count("<figure")


def test_the_page_shows_where_the_model_fails(compared: Compared) -> None:
    for sentence in compared.document["failure"]["explanation"].split(". "):
        assert str(escape(sentence.strip("."))) in compared.page


def test_another_buildings_model_is_refused(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text((folder / "model.toml").read_text("utf-8").replace("TRIAL", "OTHER"), "utf-8")
    done = menshin("model", "compare", "other.toml", folder / "event1.mseed", "--building", folder / "building.toml")
    assert done.exit_code == 2
    assert "other.toml is of building 'OTHER'" in " ".join(done.output.replace("│", " ").split())


def test_a_wrong_model_file_ends_with_two_and_its_line(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "wrong.toml").write_text((folder / "model.toml").read_text("utf-8").replace("k_b", "k_c"), "utf-8")
    done = menshin("model", "compare", "wrong.toml", folder / "event1.mseed", "--building", folder / "building.toml")
    assert done.exit_code == 2
    assert re.search(r"line \d+: effects.elastic.k_c: no such parameter; did you mean 'k_b'\?", done.output)


def test_a_file_that_is_no_record_ends_with_one(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("a note", "utf-8")
    done = menshin("model", "compare", folder / "model.toml", "note.txt", "--building", folder / "building.toml")
    assert done.exit_code == 1
    assert "has an unknown format" in done.output


def test_a_direction_that_nothing_measured_is_stated(folder: Path, tmp_path: Path) -> None:
    along_y = (folder / "model.toml").read_text("utf-8").replace('direction = "x"', 'direction = "y"')
    (tmp_path / "y.toml").write_text(along_y, "utf-8")
    done = menshin("model", "compare", "y.toml", folder / "event1.mseed", "--building", folder / "building.toml")
    assert done.exit_code == 1
    assert "neither force nor motion of the layer is known in direction y" in " ".join(done.output.split())
