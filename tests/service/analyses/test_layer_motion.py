"""A building whose base slab turns: from its files to the API and the page."""

from collections.abc import Iterator
from pathlib import Path

import monitored_building
import numpy as np
import pytest
import torsion_building
from api_client import TestClient, client
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.records.source_poller import SourcePoller

pytestmark = pytest.mark.sqlite

MOTION = "/api/v1/events/1/layer-motion"


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """The building has had one earthquake."""
    monitored_building.write(tmp_path / "event.mseed", torsion_building.miniseed(1))
    source = f'[source]\nkind = "folder"\nlocation = "{tmp_path}"\n'
    with sessions.begin() as session:
        text = torsion_building.building_file().replace("[isolation]", source + "[isolation]", 1)
        building_store.add(session, text, tmp_path, monitored_building.NOW)
    poller = SourcePoller(
        sessions, monitored_building.SETTINGS, lambda: monitored_building.NOW, lambda _: None, lambda: False
    )
    poller.poll("PAPER")
    poller.queue_ready()
    monitored_building.work(sessions)
    with client(database_url) as made:
        yield made


@pytest.mark.slow
def test_from_the_files_to_the_api_and_the_page(api: TestClient) -> None:
    sensors = {sensor["id"]: sensor for sensor in api.get("/api/v1/buildings/PAPER").json()["channels"]}
    assert sensors["XX.PAPER.A.HYX"]["position"] == list(torsion_building.CORNERS["A"])
    assert (sensors["XX.PAPER.01.HNX"]["position"], sensors["XX.PAPER.01.HNX"]["rotation"]) == (None, 0.0)
    event = api.get("/api/v1/events/1").json()
    assert [finding["kind"] for finding in event["quality"]] == []
    x, y, torsion, load = torsion_building.exact()
    layer = event["layer"]
    assert layer["peak_resultant"] == pytest.approx(np.hypot(x, y).max(), rel=0.01)
    assert abs(layer["peak_torsion"] - np.abs(torsion).max()) < 4 * layer["peak_torsion_std"]
    assert layer["torsion_lowest_frequency"] == 0.0
    assert layer["axial_load_level"] == "1F"
    assert (layer["lowest_axial_load"], layer["highest_axial_load"]) == (
        pytest.approx(load.min(), abs=0.01),
        pytest.approx(load.max(), abs=0.01),
    )
    of_x = event["directions"][0]
    assert abs(of_x["peak_displacement"] - np.abs(x).max()) < 4 * of_x["peak_displacement_std"]
    assert (
        abs(of_x["residual_displacement"] - (x[-1000:].mean() - x[:200].mean()))
        < 4 * (of_x["residual_displacement_std"])
    )
    series(api)
    page(api)


def series(api: TestClient) -> None:
    """All histories, one, thinned ones, and CSV."""
    x, y, torsion, load = torsion_building.exact()
    whole = api.get(MOTION).json()
    inside = np.abs(np.array(whole["torsion"]) - torsion) < 1.96 * np.array(whole["torsion_std"])
    assert 0.9 < inside.mean() <= 1.0
    assert np.array(whole["displacement_x"]) == pytest.approx(x, abs=2e-4)
    assert np.array(whole["displacement_y"]) == pytest.approx(y, abs=2e-4)
    assert np.array(whole["axial_load"]) == pytest.approx(load, abs=5e-3)
    one = api.get(MOTION, params={"series": "torsion", "points": 500}).json()
    assert len(one["time"]) == len(one["torsion"]) <= 500
    assert one["displacement_x"] is None
    csv = api.get(MOTION, params={"format": "csv"}).text.splitlines()
    assert csv[0] == "time,displacement_x,displacement_y,torsion,torsion_std,axial_load"
    assert len(csv) == x.size + 1
    known = api.get(MOTION)
    assert api.get(MOTION, headers={"If-None-Match": known.headers["ETag"]}).status_code == 304
    assert api.get("/api/v1/events/9/layer-motion").status_code == 404


def page(api: TestClient) -> None:
    """The numbers in mm and mrad, and three pictures."""
    text = api.get("/buildings/PAPER").text
    for printed in ("Peak resultant displacement", "mrad", "of the weight", "Residual displacement"):
        assert printed in text
    for name in ("orbit", "torsion", "axial-load"):
        assert f"/charts/{name}.svg?layer=1" in text
        assert api.get(f"/charts/{name}.svg?layer=1").text.startswith("<svg")
        assert api.get(f"/charts/{name}.svg?layer=2").status_code == 404
