"""From an engineer's request to a comparison, and the jobs that a new event queues by itself."""

import re
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from html import unescape
from pathlib import Path
from typing import Any

import monitored_building
import pytest
from api_client import client
from fastapi.testclient import TestClient
from model_jobs import create_model, finished_job, job_events, work
from sqlalchemy.orm import Session, sessionmaker

from core.paper import ISOLATOR
from service.jobs import kept as kept_results
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.models.windows import SHOWN
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
        assert good["noise_ratio"] < 2 < bad["noise_ratio"]
        assert good["nrmse"] < 0.05 < bad["nrmse"]
        assert good["displacement_nrmse"] < 0.05 < bad["displacement_nrmse"]
        assert (good["direction"], good["role"]) == ("x", "later")
    one = api.get(f"/api/v1/comparisons/{right[0]['id']}").json()
    assert set(one["acceleration_nrmse"]) == {"1F", "4F", "RF"}
    series = api.get(f"/api/v1/comparisons/{right[0]['id']}/force", params={"points": 100}).json()
    assert len(series["time"]) == len(series["modelled"]) == len(series["measured"]) <= 100
    lines = api.get(f"/api/v1/comparisons/{right[0]['id']}/force", params={"format": "csv"}).text.splitlines()
    assert (lines[0], len(lines)) == ("time,displacement,measured,modelled", series["count"] + 1)
    page = unescape(api.get("/models/1").text)
    for picture in re.findall(r'src="(/charts/[^"]+)"', page):
        assert "<svg" in api.get(picture).text
    assert page.count('<img src="/charts/model-window') == SHOWN
    assert page.count('<img src="/charts/') == 2 + SHOWN


class Noting(ThreadPoolExecutor):
    """Threads that note the name of every function submitted to them."""

    def __init__(self) -> None:
        super().__init__(1)
        self.names: list[str] = []

    def submit(self, fn, /, *args, **kwargs) -> Future:  # type: ignore[no-untyped-def, type-arg]  # noqa: ANN001, ANN002, ANN003
        self.names.append(fn.__name__)
        return super().submit(fn, *args, **kwargs)


@pytest.mark.sqlite
@pytest.mark.parametrize(("kept", "analysed_again"), [(kept_results.IN_MEMORY, 0), (1, 2)])
def test_a_worker_analyses_an_event_once_for_all_jobs(
    api: TestClient,
    sessions: sessionmaker[Session],
    monkeypatch: pytest.MonkeyPatch,
    kept: int,
    analysed_again: int,
) -> None:
    """As long as it has room for the results; and what was analysed with other settings is another result."""
    monkeypatch.setattr(kept_results, "IN_MEMORY", kept)
    with Noting() as processes:
        worker = Worker(
            sessions, lambda: processes, monitored_building.SETTINGS, KINDS, clock=lambda: monitored_building.NOW
        )
        model = f"/api/v1/models/{create_model(api, LINEAR)}/comparisons"
        for expected in ([*2 * ["analyse"], "compared"], [*analysed_again * ["analyse"], "compared"]):
            processes.names.clear()
            api.post(model, json={})
            worker.run_until_idle()
            assert processes.names == expected
        before = _errors(api, model)
        compared(api, sessions, 1)  # by another worker, which has nothing
        assert _errors(api, model) == before
        processes.names.clear()
        api.post("/api/v1/events/2/analyses", json={"sensors": ["base", "roof"]})
        worker.run_until_idle()
        api.post(model, json={})
        worker.run_until_idle()
        assert processes.names[0] == "analyse"
        assert processes.names.count("analyse") == 1 + analysed_again
        after = _errors(api, model)
        assert (after[1] == before[1], after[2] == before[2]) == (True, False)


def _errors(api: TestClient, comparisons: str) -> dict[int, float]:
    """The latest error of a model's force in each event."""
    rows = api.get(comparisons).json()["items"]
    return {row["event"]: row["nrmse"] for row in sorted(rows, key=lambda row: int(row["id"]))}


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
