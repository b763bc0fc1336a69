"""A model of both directions, by the jobs of a building that measures both."""

from collections.abc import Iterator
from pathlib import Path

import monitored_building
import paper_records
import pytest
from api_client import client
from biaxial_records import biaxial_records
from fastapi.testclient import TestClient
from model_jobs import MODELS, finished_job, work
from sqlalchemy.orm import Session, sessionmaker

from core.paper import ISOLATOR
from service.buildings import store as building_store
from service.records.ingest import ingest

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

OFF = {name: dict(values) for name, values in ISOLATOR.effects.items()} | {"elastic": {"k_b": 0.9 * 475e6}}


def building_file() -> str:
    """The paper's, each sensor of two axes."""
    blocks = paper_records.building_file().split("[[channel]]")
    across = [block.replace('X"', 'Y"', 1).replace('"x"', '"y"') for block in blocks[1:]]
    return "[[channel]]".join([*blocks, *across])


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session]) -> Iterator[TestClient]:
    """An engineer's client; the building has had one earthquake."""
    _, samples = biaxial_records()
    with sessions.begin() as session:
        building = building_store.add(session, building_file(), Path("/"), monitored_building.NOW)
        data = paper_records.miniseed(samples)
        ingest(
            session,
            building,
            "event.mseed",
            "/event.mseed",
            data,
            monitored_building.NOW,
            settings=monitored_building.SETTINGS,
        )
    work(sessions)
    with client(database_url) as made:
        yield made


def test_a_fit_is_to_both_and_each_has_its_errors(api: TestClient, sessions: sessionmaker[Session]) -> None:
    """5 %: 1 % of noise, and what the estimate of the force adds."""
    first = api.post(MODELS, json={"direction": "xy", "effects": OFF}).json()["id"]
    made = finished_job(api, sessions, f"/api/v1/models/{first}/fits", {})["result"]["made"]
    assert api.get(f"/api/v1/models/{made}").json()["direction"] == "xy"
    before, after = (api.get(f"/api/v1/models/{model}/comparisons").json()["items"] for model in (first, made))
    assert [one["direction"] for one in before] == [one["direction"] for one in after] == ["x", "y"]
    for was, now in zip(before, after, strict=True):
        assert now["nrmse"] < 0.05 < was["nrmse"]
        assert now["displacement_nrmse"] < 0.05
    assert {one["direction"] for one in api.get(f"/api/v1/models/{made}/trend").json()["items"]} == {"x", "y"}
    assert "direction y" in api.get("/charts/model-loop.svg", params={"comparison": after[1]["id"]}).text
    assert ">direction<" in api.get("/charts/model-trend.svg", params={"model": made}).text
