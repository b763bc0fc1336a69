"""From an engineer's request to a comparison, and the jobs that a new event queues by itself."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import monitored_building
import pytest
from api_client import client
from fastapi.testclient import TestClient
from model_jobs import create_model, finished_job, job_events, work
from sqlalchemy.orm import Session, sessionmaker

from core.paper import ISOLATOR
from service.records.source_poller import SourcePoller

pytestmark = pytest.mark.slow

TRUTH = {name: dict(values) for name, values in ISOLATOR.effects.items()}
LINEAR = {"elastic": {"k_b": 4.75e8}, "viscous": {"c_b": 6e6}}


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's client; the paper's building has had two earthquakes."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[:2])
    with client(database_url, progress_patience=1) as api:
        yield api


def compared(api: TestClient, sessions: sessionmaker[Session], model: int) -> list[dict[str, Any]]:
    finished_job(api, sessions, f"/api/v1/models/{model}/comparisons", {})
    rows: list[dict[str, Any]] = api.get(f"/api/v1/models/{model}/comparisons").json()["items"]
    return rows


def test_the_right_model_leaves_noise_and_a_wrong_one_more(api: TestClient, sessions: sessionmaker[Session]) -> None:
    right, wrong = (compared(api, sessions, create_model(api, effects)) for effects in (TRUTH, LINEAR))
    assert [row["event"] for row in right] == [row["event"] for row in wrong] == [1, 2]
    for good, bad in zip(right, wrong, strict=True):
        assert good["floors"] < 2 < bad["floors"]
        assert good["nrmse"] < 0.05 < bad["nrmse"]
        assert good["displacement_nrmse"] < 0.05 < bad["displacement_nrmse"]
        assert (good["direction"], good["role"]) == ("x", "later")
    one = api.get(f"/api/v1/comparisons/{right[0]['id']}").json()
    assert set(one["acceleration_nrmse"]) == {"1F", "4F", "RF"}
    series = api.get(f"/api/v1/comparisons/{right[0]['id']}/force", params={"points": 100}).json()
    assert len(series["time"]) == len(series["modelled"]) == len(series["measured"]) <= 100
    lines = api.get(f"/api/v1/comparisons/{right[0]['id']}/force", params={"format": "csv"}).text.splitlines()
    assert (lines[0], len(lines)) == ("time,displacement,measured,modelled", series["count"] + 1)
    page = api.get("/models/1").text
    for picture in re.findall(r'src="(/charts/[^"]+)"', page):
        assert "<svg" in api.get(picture).text
    assert page.count("/charts/") == 2


def test_who_waits_learns_how_far_it_is(api: TestClient, sessions: sessionmaker[Session]) -> None:
    requested = api.post(f"/api/v1/models/{create_model(api, LINEAR)}/comparisons", json={}).headers["Location"]
    assert [one["state"] for one in job_events(api, requested)] == ["waiting"]
    work(sessions)
    (last,) = job_events(api, requested)
    assert (last["state"], last["progress"]["stages"], last["asked_by"]) == ("done", 3, "loopback")
    assert api.get("/api/v1/jobs/999/progress").status_code == 404


def test_the_accepted_model_is_compared_with_every_new_event(
    api: TestClient, sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    model = create_model(api, LINEAR)
    assert api.get(f"/api/v1/models/{model}/trend").json()["items"] == []
    api.post(f"/api/v1/models/{model}/accept")
    monitored_building.write(tmp_path / "records" / "new.mseed", monitored_building.earthquakes()[2])
    poller = SourcePoller(
        sessions, monitored_building.SETTINGS, lambda: monitored_building.NOW, lambda _: None, lambda: False
    )
    poller.poll("PAPER")
    poller.queue_ready()
    work(sessions)
    trend = api.get(f"/api/v1/models/{model}/trend").json()
    assert [(one["event"], one["fitted"], one["missed"]) for one in trend["items"]] == [(3, False, False)]
    assert trend["finding"] is None  # nothing was fitted, so there is nothing it was used to


def test_what_cannot_be_compared_is_refused(api: TestClient) -> None:
    model = create_model(api, LINEAR)
    refused = api.post(f"/api/v1/models/{model}/comparisons", json={"events": [1, 77]})
    assert refused.status_code == 409
    assert "events 77" in refused.json()["detail"]
    assert api.post(f"/api/v1/models/{model}/comparisons", json={"events": []}).status_code == 422
    assert api.post(f"/api/v1/models/{model}/comparisons", json={"events": [1.5]}).status_code == 422


def test_a_whole_number_may_be_written_with_a_point(api: TestClient) -> None:
    """JSON has one kind of number, and 2.0 is an integer in its schemas."""
    model = create_model(api, LINEAR)
    queued = api.post(f"/api/v1/models/{model}/comparisons", json={"events": [1, 2.0]})
    assert (queued.status_code, queued.json()["arguments"]) == (202, {"events": [1, 2]})
