"""Charts of an earthquake for engineers, and the forms of its page."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import monitored_building
import numpy as np
import pytest
import vl_convert
from api_client import client
from fastapi.testclient import TestClient
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker

from service.analyses.event_charts import Trace, overlaid_loops, peaks_over_height, spectra, waveforms
from service.analyses.tables import Analysis, DirectionResult
from service.db.blobs import encode
from service.documents import live

pytestmark = pytest.mark.sqlite

FLOOR = {"level": "1F", "direction": "x", "peak": 2.0, "std": 0.01, "is_measured": True}
STOREY = {"level": "2F", "direction": "x", "peak": 0.004, "std": None}


def rows(spec: dict[str, Any]) -> list[dict[str, Any]]:
    return [row for each in spec["datasets"].values() for row in each]


def test_six_channels_of_an_hour_keep_their_peaks_in_half_a_megabyte() -> None:
    samples = 0.1 * np.random.default_rng(1).standard_normal(360_000)
    samples[123_456] = 7.0
    spec = waveforms({f"XX.A.0{n}.HNX": ("acceleration", [Trace(0.0, 100.0, samples)]) for n in range(6)}).to_dict()
    assert max(row["value"] for row in rows(spec)) == 700.0
    assert len(json.dumps(live.live(spec))) < 500_000
    assert "XX.A.01.HNX (gal)" in live.as_csv(spec).decode()


def test_a_gap_is_not_bridged_and_missing_samples_are_left_out() -> None:
    broken = [Trace(0.0, 1.0, np.array([1.0, np.nan, 2.0])), Trace(10.0, 1.0, np.array([3.0, 4.0]))]
    spec = waveforms({"XX.A.01.HYX": ("displacement", broken)}).to_dict()
    assert [(row["piece"], row["time"], row["value"]) for row in rows(spec)] == [
        (0, 0.0, 1e3),
        (0, 2.0, 2e3),
        (1, 10.0, 3e3),
        (1, 11.0, 4e3),
    ]


def test_the_shear_strain_is_the_displacement_over_the_height_of_the_rubber() -> None:
    u = np.linspace(-0.1, 0.1, 50)
    spec = overlaid_loops({"one": (u, 1e6 * u)}, "Loop", 0.2).to_dict()
    strained = [row for row in rows(spec) if "strain" in row]
    assert all(row["strain"] == pytest.approx(row["displacement"] / 2, rel=1e-5) for row in strained)
    svg = vl_convert.vegalite_to_svg(live.live(spec))
    assert "shear strain of the rubber (%)" in svg
    assert ">\N{MINUS SIGN}50<" in svg
    assert "shear strain" not in json.dumps(overlaid_loops({"one": (u, 1e6 * u)}, "Loop").to_dict())


@pytest.mark.parametrize(("height", "label", "value"), [(4.0, "% of the storey height", 0.1), (None, "mm", 4.0)])
def test_a_drift_is_given_over_the_height_where_it_is_known(height: float | None, label: str, value: float) -> None:
    spec = peaks_over_height([FLOOR], [STOREY], {"2F": height}).to_dict()
    assert label in live.as_csv(spec).decode()
    assert {(row["level"], row["peak"]) for row in rows(spec)} == {("1F", 200.0), ("2F", value)}


def test_spectra_are_in_gal_and_zeros_have_no_place_on_a_logarithmic_axis() -> None:
    spec = spectra({"ground, x": ([0.1, 1.0, 2.0], [1.5, 0.2, 0.0])}).to_dict()
    assert [(row["period"], row["value"]) for row in rows(spec)] == [(0.1, 150.0), (1.0, 20.0)]


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """The paper's building after two earthquakes."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[1:3])
    with client(database_url) as api:
        yield api


@pytest.mark.slow
def test_the_page_shows_chosen_channels_and_another_earthquake_and_asks_for_another_analysis(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    page = api.get("/events/2?channel=XX.PAPER.01.HNX&channel=XX.PAPER.01.HYX&other=1").text
    shown = re.search(r'data-chart="(/charts/waveforms[^"]+)"', page)
    assert shown is not None
    assert shown[1].count("channel=") == 2
    for part in ("spectra", "peaks", "force-parts", "cycles", "loops"):
        address = re.search(rf'data-chart="(/charts/{part}[^"]+)"', page)
        assert address is not None, part
        assert api.get(address[1].replace("&amp;", "&")).json()["usermeta"]["dark"]
    with sessions() as session:
        query = select(Analysis.event_id, DirectionResult.id).join(DirectionResult.analysis)
        result = dict(session.execute(query).all())
    assert re.search(rf"/charts/loops.json\?result={result[2]}&(amp;)?other={result[1]}\"", page)
    assert len(page) < 100_000
    (records,) = re.findall(r'href="(/fdsnws/dataselect[^"]+)"', page)
    assert api.get(records.replace("&amp;", "&")).headers["content-type"] == "application/vnd.fdsn.mseed"

    refused = api.post("/events/2/analyses", data={"low": "0.1", "high": "60"})
    assert refused.status_code == 409
    assert "below 50 Hz" in refused.text
    assert 'value="60"' in refused.text
    job = api.post("/events/2/analyses", data={"estimator": "cms"}).headers["location"]
    assert "analysis of the earthquake of" in api.get(job).text
    monitored_building.work(sessions)
    assert api.get(job).headers["location"] == "/events/2"
    assert api.get("/api/v1/events/2").json()["analysis"]["estimator"] == "cms"

    with sessions.begin() as session:  # as of an analysis that a later one superseded
        session.execute(update(DirectionResult).values(force=encode(np.zeros(0)), displacement=encode(np.zeros(0))))
    for chart in ("restoring-force", "loop", "loops", "force-parts"):
        assert api.get(f"/charts/{chart}.csv?result=1").status_code == 404, chart
