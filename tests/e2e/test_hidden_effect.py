"""An engineer's API calls: from the records of a layer with a hidden effect to a model that predicts better."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from api_client import client
from fastapi.testclient import TestClient
from hidden import files
from hidden.trial import Trial, trial

from service import roles
from service.buildings import store as building_store
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.records import events
from service.records.source_poller import SourcePoller
from service.records.sources.source import Arrival
from service.roles import executors
from service.settings import Settings

pytestmark = pytest.mark.slow

BROUGHT = slice(1, 4)
"""Earthquakes of the trial; the last one is held out of every fit."""


@pytest.fixture(scope="module")
def hidden() -> Trial:
    """A law of the same form as the library's, and design values that are off by 3 %."""
    return trial("hardening", 1)


class Engineer:
    """Request work from the API, and wait until it is done."""

    def __init__(self, api: TestClient, worker: Worker) -> None:
        self.api, self.worker = api, worker

    def read(self, address: str) -> Any:  # noqa: ANN401  whatever JSON holds
        answer = self.api.get(f"/api/v1{address}")
        assert answer.status_code == 200, answer.text
        return answer.json()

    def done(self, address: str, **wanted: object) -> dict[str, Any]:
        """Result of a job."""
        requested = self.api.post(f"/api/v1{address}", json=wanted)
        assert requested.status_code == 202, requested.text
        self.worker.run_until_idle()
        job = self.api.get(requested.headers["Location"]).json()
        assert (job["state"], job["refusal"]) == ("done", None), job
        result: dict[str, Any] = job["result"]
        return result


@contextmanager
def engineer(of: Trial, folder: Path) -> Iterator[Engineer]:
    """A client of a service with uploaded records of the building and a worker process of its own."""
    address = f"sqlite:///{folder / 'menshin.sqlite'}"
    settings = Settings(database_url=address, event_grace=0, settle_time=0, workers=1)
    records = files.write(of, folder)[BROUGHT]
    with roles.migrated(settings) as sessions, client(address) as api:
        now = datetime.now(UTC)
        with sessions.begin() as session:
            building = building_store.add(session, (folder / files.BUILDING).read_text("utf-8"), folder, now)
        brought = tuple(Arrival(name=one.name, origin=str(one), data=one.read_bytes()) for one in records)
        assert [one.state for one in SourcePoller(sessions, settings).receive(building, brought)] == ["read"] * len(
            records
        )
        with sessions.begin() as session:
            events.queue_now(session, building, now)
        processes = executors(settings)
        try:
            worker = Worker(sessions, processes, settings, KINDS)
            worker.run_until_idle()
            yield Engineer(api, worker)
        finally:
            processes().shutdown(wait=True)


def test_the_error_falls_on_an_earthquake_that_nothing_was_fitted_to(hidden: Trial, tmp_path: Path) -> None:
    with engineer(hidden, tmp_path) as at:
        known = sorted(at.read("/buildings/TRIAL/events")["items"], key=lambda one: str(one["start"]))
        assert [one["state"] for one in known] == ["analysed"] * 3
        left_out = [known[-1]["id"]]
        first = at.api.post("/api/v1/buildings/TRIAL/models", json={"direction": "x"}).json()["id"]
        assert at.done(f"/models/{first}/comparisons")["fails"]
        number = at.done(f"/models/{first}/diagnoses", hold_out=left_out)["diagnosis"]
        diagnosis = at.read(f"/diagnoses/{number}")
        assert (diagnosis["outcome"], diagnosis["set"], diagnosis["held_out"]) == (
            "effect",
            [*hidden.effects],
            left_out,
        )
        second = at.done(f"/models/{first}/effects", effect=diagnosis["set"][0], hold_out=left_out)["made"]
        assert at.api.post(f"/api/v1/models/{second}/accept").json()["state"] == "current"
        before, after = at.read(f"/models/{second}/lineage")["items"]
        assert (before["state"], after["errors"]["held_out"]["events"]) == ("draft", 1)
        (was,) = (one["nrmse"] for one in at.read(f"/models/{first}/comparisons")["items"] if one["event"] in left_out)
        assert after["errors"]["held_out"]["nrmse"] < 0.5 * was
