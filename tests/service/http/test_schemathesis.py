"""Whatever the OpenAPI document allows, and whatever it does not, is answered as the document says.

A tool that knows nothing of us but the document asks a service that holds a building, its events, their results and a
refused event: examples, edges, wrong values and chains of requests. By hand, as long as one likes:

    schemathesis run http://127.0.0.1:8000/openapi.json -H "X-API-Key: KEY" --max-time 600
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from threading import Event as Signal, Thread

import httpx
import monitored_building
import pytest
from api_server import api_server
from sqlalchemy import update
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import Role
from service.access.tables import ApiKey
from service.db import process_leases
from service.db.process_leases import POLLING, POLLING_LEASE, WORKING

pytestmark = pytest.mark.slow

FAR = 1_234_567_890
"""Number of the key that asks."""
PHASES = {"sqlite": ("--max-examples", "6"), "postgresql": ("--phases", "examples,coverage")}
"""SQLite: all phases, with so many random requests per operation. PostgreSQL: all documented examples and boundary
values, where what depends on the database (the range of its integers, its text) lies; before a statement is sent both
run the same code."""


@pytest.fixture
def key(sessions: sessionmaker[Session], tmp_path: Path) -> str:
    """A key of a service in full use; its number is far from those in the document, because its own may be revoked."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records")
    with sessions.begin() as session:
        keys.create(session, "another", Role.viewer, datetime.now(UTC))
        key = keys.create(session, "schemathesis", Role.admin, datetime.now(UTC))
        session.execute(update(ApiKey).where(ApiKey.name == "schemathesis").values(id=FAR))
        return key


@pytest.fixture
def parts(sessions: sessionmaker[Session]) -> Iterator[None]:
    """A poller and a worker, as far as others see them."""
    stop = Signal()

    def live() -> None:
        while True:
            with sessions.begin() as session:
                for right in (POLLING, WORKING):
                    process_leases.hold(session, right, "a part", datetime.now(UTC), POLLING_LEASE)
            if stop.wait(10):
                return

    thread = Thread(target=live)
    thread.start()
    yield
    stop.set()
    thread.join()


@pytest.fixture
def address(database_url: str, key: str, parts: None) -> Iterator[str]:
    long_ago = {"poll_interval": 1e9, "worker_patience": 1e9, "disk_reserve": 0}  # the records came years ago
    with api_server(database_url, progress_patience=0.1, **long_ago) as found:  # nobody works: streams would wait
        yield found


def test_schemathesis_finds_nothing(address: str, key: str, database_kind: str, tmp_path: Path) -> None:
    """All its checks; in a process of its own, as its command does it."""
    options = ["--header", f"X-API-Key: {key}", "--continue-on-failure", "--seed", "1"]
    options += ["--request-timeout", "60"]  # s: a report is slow beside other tests; 10 s is the usual limit
    options += PHASES[database_kind]
    command = [sys.executable, "-m", "schemathesis.cli", "run", f"{address}/openapi.json", *options, "--no-color"]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    described = httpx.get(f"{address}/openapi.json", timeout=60.0).json()
    operations = sum(len(methods) for methods in described["paths"].values())
    assert f"Tested: {operations}\n" in done.stdout
