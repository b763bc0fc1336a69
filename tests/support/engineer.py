"""An engineer at the API: asks for work on models of the paper's building, and waits until it is done."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import watched
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session, sessionmaker

from service.worker import Worker

MODELS = "/api/v1/buildings/PAPER/models"


def work(sessions: sessionmaker[Session]) -> None:
    """Do all work that waits."""
    with ThreadPoolExecutor(1) as pool:
        Worker(sessions, lambda: pool, watched.SETTINGS, clock=lambda: watched.NOW).run_until_idle()


def made(asking: TestClient, effects: dict[str, dict[str, float]]) -> int:
    """Number of a first model of these effects."""
    number: int = asking.post(MODELS, json={"direction": "x", "effects": effects}).json()["id"]
    return number


def done(asking: TestClient, sessions: sessionmaker[Session], address: str, wanted: dict[str, Any]) -> dict[str, Any]:
    """The job that was asked for at an address, once it is done."""
    asked = asking.post(address, json=wanted)
    assert asked.status_code == 202, asked.text
    work(sessions)
    found: dict[str, Any] = asking.get(asked.headers["Location"]).json()
    assert (found["state"], found["error"], found["refusal"]) == ("done", None, None)
    return found
