"""`menshin model forecast` by the front door: table, JSON, page, scaling, limits and refusals."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import menshin
from hidden.trial import Trial

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]

SPECTRUM = """
[design_spectrum]
periods = [0.1, 0.5, 2.0, 5.0]
acceleration = [5.0, 8.0, 2.0, 0.8]
source = "level 2, 2011"
"""
LIMITED = "[isolation]\nmoat_clearance = 0.5\ndesign_displacement = 0.06\n"


@dataclass(frozen=True)
class Forecast:
    text: str
    document: dict[str, Any]
    page: str


@pytest.fixture(scope="module")
def building(folder: Path) -> Path:
    """With limits that can be checked, heights and a design spectrum."""
    text = (folder / "building.toml").read_text("utf-8").replace("[isolation]\n", LIMITED)
    text = text.replace('role = "floor"\n', 'role = "floor"\nheight = 4.0\n') + SPECTRUM
    (folder / "limited.toml").write_text(text, "utf-8")
    return folder / "limited.toml"


def run(folder: Path, building: Path, *more: object, motion: str = "event5.mseed") -> Any:  # noqa: ANN401  a result
    records = [part for number in (1, 2, 4) for part in ("--record", folder / f"event{number}.mseed")]
    return menshin("model", "forecast", folder / "model.toml", folder / motion, "--building", building, *records, *more)


@pytest.fixture(scope="module")
def forecast(folder: Path, building: Path) -> Forecast:
    out = folder / "out"
    done = run(folder, building, "--json", out / "f.json", "--html", out / "f.html")
    assert done.exit_code == 0, done.output
    document = json.loads((out / "f.json").read_text("utf-8"))
    return Forecast(" ".join(done.output.split()), document, (out / "f.html").read_text("utf-8"))


def test_the_interval_holds_what_happened(forecast: Forecast, moat: Trial) -> None:
    """The last earthquake, which the model was not given; it is stronger than those that it was."""
    (one,) = forecast.document["forecasts"]
    peaks = {(peak["quantity"], peak["level"]): peak for peak in one["peaks"]}
    moved = peaks["displacement", ""]
    assert moved["low"] < np.abs(moat.events[4].displacement[0]).max() < moved["high"]
    for row, level in ((0, "1F"), (3, "4F"), (7, "RF")):
        peak = peaks["acceleration", level]
        assert peak["low"] < np.abs(moat.events[4].acceleration[0, row]).max() < peak["high"], level
        assert peak["low"] < peak["value"] < peak["high"]
    assert len([key for key in peaks if key[0] == "drift"]) == 7
    assert forecast.document["displacement"] == pytest.approx(np.abs(moat.events[3].displacement[0]).max(), rel=0.02)
    assert not one["out_of_range"]
    assert "times as far as in any record" in " ".join(one["remarks"])


def test_limits_of_the_building_have_their_margin(forecast: Forecast) -> None:
    limits = {one["check"]: one for one in forecast.document["forecasts"][0]["limits"]}
    moved = next(one for one in forecast.document["forecasts"][0]["peaks"] if one["quantity"] == "displacement")
    design = limits["design_displacement"]
    assert design["value"] == pytest.approx(moved["value"] / 0.06)
    assert [one["level"] for one in design["margins"]] == ["watch", "inspect", "act"]
    assert design["margins"][2]["share"] == pytest.approx(moved["value"] / 0.06)
    assert design["margins"][2]["share_high"] >= moved["high"] / 0.06 * (1 - 1e-9)
    assert limits["moat_clearance"]["outcome"] == "undecided"  # direction y is not forecast, as in a verdict
    assert limits["residual_displacement"]["reason"] == "A forecast does not give the displacement that remains."
    drift = max(one["high"] for one in forecast.document["forecasts"][0]["peaks"] if one["quantity"] == "drift")
    assert limits["storey_drift"]["value"] + limits["storey_drift"]["uncertainty"] == pytest.approx(drift / 4.0)
    assert limits["floor_acceleration"]["value"] > 0


def test_the_text_and_the_page_show_the_same(forecast: Forecast) -> None:
    moved = next(one for one in forecast.document["forecasts"][0]["peaks"] if one["quantity"] == "displacement")
    assert f"{1e3 * moved['value']:.0f} mm" in forecast.text
    assert f"{1e3 * moved['low']:.0f} to {1e3 * moved['high']:.0f} mm" in forecast.text
    assert "Limits of the building" in forecast.text
    for title in ("Displacement of the isolators", "Accelerations of the levels", "Limits of the building"):
        assert title in forecast.page
    assert "<svg" in forecast.page
    assert "<script" not in forecast.page


def test_a_motion_is_scaled_to_what_is_asked(folder: Path, building: Path) -> None:
    out = folder / "out" / "scaled.json"
    for asked, value in (("200 gal", 2.0), ("0.15 g", 1.47099), ("1.5", 1.5)):
        assert run(folder, building, "--pga", asked, "--json", out).exit_code == 0
        assert json.loads(out.read_text())["forecasts"][0]["pga"] == pytest.approx(value, rel=1e-4)
    assert run(folder, building, "--displacement", "40 mm", "--json", out).exit_code == 0
    assert json.loads(out.read_text())["forecasts"][0]["peaks"][0]["value"] == pytest.approx(0.04, rel=1e-3)
    done = run(folder, building, "--design-spectrum", "--json", out)
    (one,) = json.loads(out.read_text())["forecasts"]
    assert one["out_of_range"]
    assert "OUT OF RANGE" in done.output
    assert all(limit["outcome"] != "passed" for limit in one["limits"] if limit["check"] == "floor_acceleration")


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--pga", "200 mm"), "has the unit of displacement; give acceleration, such as 400 gal"),
        (("--pga", "strong"), "'strong' is not a number with a unit"),
        (("--pga", "3 furlong"), "unit 'furlong' is not known"),
        (("--pga", "0"), "cannot be scaled to a peak ground acceleration of 0 m/s²"),
        (("--pga", "-2"), "cannot be scaled to a peak ground acceleration of -2 m/s²"),
        (("--displacement", "400 m"), "cannot be scaled to a displacement of 400 m"),
        (("--pga", "1", "--displacement", "1 mm"), "scaled to one thing"),
        (("--at", "2001-01-01"), "lies before the end of the last record"),
        (("--temperature", "451"), "temperature of the isolators must be within"),
    ],
)
def test_impossible_wishes_are_refused_in_words(
    folder: Path, building: Path, options: tuple[str, ...], reason: str
) -> None:
    done = run(folder, building, *options)
    assert done.exit_code == 1
    assert reason in " ".join(done.output.split())


def test_a_design_spectrum_must_be_in_the_building_file(folder: Path) -> None:
    done = run(folder, folder / "building.toml", "--design-spectrum")
    assert (done.exit_code, "has no [design_spectrum]" in done.output) == (1, True)


def csv(columns: str, rows: str) -> str:
    return f"# start: 2024-01-01T00:00:00Z\n# rate: 100\n{columns}\n" + rows


QUAKE = [float(one) for one in np.round(100 * np.sin(np.arange(2000) / 30) * np.hanning(2000), 3)]


@pytest.mark.parametrize(
    ("columns", "numbers", "reason"),
    [
        ("K.ABC..HNN [gal]", [QUAKE], "it has the direction y, the model is of x"),
        ("K.ABC..HNX [mm]", [QUAKE], "it has no acceleration"),
        ("K.ABC..HNX [g]", [QUAKE], "more than any earthquake"),
        ("K.ABC..HNQ [gal]", [QUAKE], "the direction of K.ABC..HNQ is not known"),
        ("K.ABC..HNX [gal], K.ABC..HNE [gal]", [QUAKE, QUAKE], "are both of direction x"),
        ("XX.TRIAL.01.HNX [gal]", [QUAKE], "records of the building, but none of the ground's acceleration"),
        ("K.ABC..HNX [gal]", [["nan", *QUAKE]], "1 of 2001 samples of K.ABC..HNX are not numbers"),
        ("K.ABC..HNX [gal]", [[0.0] * 50], "the ground does not move"),
    ],
)
def test_what_is_no_motion_for_the_model_is_refused_in_words(
    folder: Path, building: Path, columns: str, numbers: list[list[object]], reason: str
) -> None:
    rows = "\n".join(", ".join(map(str, row)) for row in zip(*numbers, strict=True)) + "\n"
    (folder / "wave.csv").write_text(csv(columns, rows), "utf-8")
    done = run(folder, building, motion="wave.csv")
    assert done.exit_code == 1, done.output
    assert reason in " ".join(done.output.split())


def test_files_of_single_components_are_one_motion(folder: Path, building: Path) -> None:
    for number, code in enumerate(("HNE", "HNN", "HNU")):
        rows = "\n".join(f"{(number + 1) * one:.3f}" for one in QUAKE) + "\n"
        (folder / f"wave.{code}.csv").write_text(csv(f"K.ABC..{code} [gal]", rows), "utf-8")
    out = folder / "out" / "joined.json"
    others = (folder / "wave.HNN.csv", folder / "wave.HNU.csv", folder / "event5.mseed")
    done = run(folder, building, *others, "--json", out, motion="wave.HNE.csv")
    assert done.exit_code == 0, done.output
    assert [one["motion"] for one in json.loads(out.read_text())["forecasts"]] == ["wave.HNE", "event5"]
