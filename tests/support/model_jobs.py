"""Work on models of the paper's building, requested at the API and awaited."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import monitored_building
from cached_executor import CachedExecutor
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session, sessionmaker

from service.jobs.worker import Worker
from service.kinds import KINDS

MODELS = "/api/v1/buildings/PAPER/models"


def work(sessions: sessionmaker[Session]) -> None:
    """Do all work that waits; what was computed before in this run of the tests is not computed again."""
    Worker(
        sessions, CachedExecutor, monitored_building.SETTINGS, KINDS, clock=lambda: monitored_building.NOW
    ).run_until_idle()


def work_with_progress(sessions: sessionmaker[Session]) -> None:
    """Do all work that waits in a thread of its own, so that the worker reports progress meanwhile."""
    with TemporaryDirectory() as notes, ThreadPoolExecutor(1) as pool:
        worker = Worker(
            sessions,
            lambda: pool,
            monitored_building.SETTINGS,
            KINDS,
            clock=lambda: monitored_building.NOW,
            notes=Path(notes),
        )
        worker.run_until_idle()


def create_model(api: TestClient, effects: dict[str, dict[str, float]]) -> int:
    """Number of a first model of these effects."""
    number: int = api.post(MODELS, json={"direction": "x", "effects": effects}).json()["id"]
    return number


def finished_job(
    api: TestClient, sessions: sessionmaker[Session], address: str, wanted: dict[str, Any]
) -> dict[str, Any]:
    """The job at an address, once it is done."""
    requested = api.post(address, json=wanted)
    assert requested.status_code == 202, requested.text
    work(sessions)
    found: dict[str, Any] = api.get(requested.headers["Location"]).json()
    assert (found["state"], found["error"], found["refusal"]) == ("done", None, None)
    return found


def job_events(api: TestClient, job: str) -> list[dict[str, Any]]:
    """A job's server-sent events, until it ends or there is no news for long."""
    answer = api.get(f"{job}/progress")
    assert answer.headers["content-type"].startswith("text/event-stream")
    return [json.loads(line.removeprefix("data: ")) for line in answer.text.splitlines() if line.startswith("data: ")]
