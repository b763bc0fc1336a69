"""Answers per second for a restoring force of 18,000 points, from a real server on loopback.

    OMP_NUM_THREADS=1 python benchmarks/api.py

One process serves everything, this one asks over one kept connection. Ours is the whole service: key, database and all.
It keeps the answers that it has written: "first" rows ask for one that nobody asked for before, of the same numbers;
"again" rows for one that is kept. Beside it, in the same process: FastAPI's default answer of the same numbers as plain
lists that lie ready, and an empty answer of a FastAPI route that does nothing. CPU time of the serving process, the
median of blocks of requests; the rows take turns.
"""

import multiprocessing
import tempfile
from datetime import UTC, datetime, timedelta
from http.client import HTTPConnection
from itertools import count
from pathlib import Path
from socket import create_server, socket
from statistics import median
from time import process_time

import numpy as np
import uvicorn
from fastapi import FastAPI, Response
from pydantic import BaseModel

from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from service.access import keys
from service.access.auth import Role
from service.analyses.tables import Analysis, DirectionResult
from service.app import create
from service.buildings import store as building_store
from service.db import migrate, sessions
from service.db.blobs import encode
from service.demo.earthquakes import recorded
from service.demo.site import building_file
from service.jobs.tables import Job
from service.records.tables import Event
from service.settings import Settings

POINTS, RATE = 18_000, 100.0
BLOCKS, REQUESTS = 9, 40
NOW = datetime(2026, 1, 1, tzinfo=UTC)
FORCE = "/api/v1/events/1/restoring-force?direction=x"
NEW = count(POINTS)
"""Without thinning as `points`; the response was not requested before."""
ASKED = {
    "empty answer": "/peer/empty",
    "FastAPI's default, force alone": "/peer/lists",
    "ours, force alone, first": f"{FORCE}&series=force&points={{}}",
    "ours, force alone, again": f"{FORCE}&series=force",
    "ours, force alone, CSV, first": f"{FORCE}&series=force&format=csv&points={{}}",
    "ours, all six series, first": f"{FORCE}&points={{}}",
    "ours, all six series, again": FORCE,
    "ours, points=2000, again": f"{FORCE}&points=2000",
    "ours, unchanged (304)": f"{FORCE}&series=force",
}


def histories() -> dict[str, np.ndarray]:
    """(POINTS,) each: the paper's building in a recorded earthquake, with 1 % of noise, which takes digits."""
    ground = np.zeros(POINTS)
    motion = recorded()[0].acceleration[0, : POINTS - 1000]
    ground[1000 : 1000 + motion.size] = motion
    moved = simulate(BUILDING, ISOLATOR, ground, RATE)
    noise = np.random.default_rng(1).standard_normal(POINTS)
    force = moved.force + 0.01 * moved.force.std() * noise
    return {
        "displacement": moved.isolator_displacement,
        "velocity": moved.isolator_velocity,
        "force": force,
        "force_rigid": 0.9 * force,
        "force_modal": 0.1 * force,
        "force_std_history": np.abs(0.01 * force),
    }


def stored(url: str, series: dict[str, np.ndarray]) -> str:
    """A database with one analysed event; a key to it."""
    migrate.upgrade(url)
    with sessions.sessions(url).begin() as session:
        building = building_store.add(session, building_file("http://127.0.0.1/"), Path("/"), NOW)
        end = NOW + timedelta(seconds=POINTS / RATE)
        event = Event(building=building, start=NOW, end=end, state="analysed", created_at=NOW, updated_at=NOW)
        session.add(event)
        session.flush()
        job = Job(kind="analyse", event_id=event.id, arguments={}, state="done", created_at=NOW)
        session.add(job)
        session.flush()
        made = {"version": "0", "settings": {}, "inputs": [], "quality": [], "peaks": {}, "current": True}
        revision = building.revisions[0].id
        analysis = Analysis(event_id=event.id, job_id=job.id, revision_id=revision, created_at=NOW, **made)
        found = {"peak_force": 1.0, "force_std": 1.0, "peak_displacement": 1.0, "rate": RATE, "count": POINTS}
        blobs = {name: encode(one) for name, one in series.items()}
        analysis.directions = [DirectionResult(direction="x", start=NOW, modes=[], cycles=[], **found, **blobs)]
        session.add(analysis)
        return keys.create(session, "benchmark", Role.viewer, NOW)


class Lists(BaseModel):
    """Response of a trivial FastAPI application: every number a float of a list."""

    time: list[float]
    force: list[float]


def application(url: str, force: np.ndarray) -> FastAPI:
    """Ours, and the two peers beside it."""
    app = create(Settings(database_url=url))
    peer = FastAPI()
    plain = {"time": (np.arange(POINTS) / RATE).tolist(), "force": force.tolist()}
    peer.add_api_route("/lists", lambda: plain, response_model=Lists)
    peer.add_api_route("/empty", lambda: Response())
    peer.add_api_route("/spent", lambda: process_time())
    app.mount("/peer", peer)
    return app


def serve(url: str, force: np.ndarray, listening: socket) -> None:
    server = uvicorn.Server(uvicorn.Config(application(url, force), log_level="error", access_log=False))
    server.run(sockets=[listening])


def asked(connection: HTTPConnection, path: str, headers: dict[str, str]) -> tuple[bytes, str]:
    """Body and tag of an answer."""
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    body = answer.read()
    assert answer.status in (200, 304), (path, answer.status, body)
    return body, answer.headers.get("ETag", "")


def spent(connection: HTTPConnection) -> float:
    """s of CPU time that the serving process has used."""
    return float(asked(connection, "/peer/spent", {})[0])


def main() -> None:
    series = histories()
    with tempfile.TemporaryDirectory() as place:
        url = f"sqlite:///{place}/menshin.sqlite"
        key = stored(url, series)
        listening = create_server(("127.0.0.1", 0))  # so that nobody need wait for the server to be up
        process = multiprocessing.Process(target=serve, args=(url, series["force"], listening))
        process.start()
        try:
            connection = HTTPConnection("127.0.0.1", listening.getsockname()[1])
            measure(connection, {"X-API-Key": key})
        finally:
            process.terminate()
            process.join()


def measure(connection: HTTPConnection, key: dict[str, str]) -> None:
    etag = asked(connection, f"{FORCE}&series=force", key)[1]
    headers = {name: key | ({"If-None-Match": etag} if "304" in name else {}) for name in ASKED}
    took: dict[str, list[float]] = {name: [] for name in ASKED}
    sizes: dict[str, int] = {}
    for block in range(1 + BLOCKS):  # the first one warms up
        for name, path in ASKED.items():
            before = spent(connection)
            for _ in range(REQUESTS):
                sizes[name] = len(asked(connection, path.format(next(NEW)), headers[name])[0])
            if block:
                took[name].append((spent(connection) - before) / REQUESTS)
    empty = median(took["empty answer"])
    default = median(took["FastAPI's default, force alone"])
    print(f"{'':36} {'ms':>8} {'per s':>8} {'kB':>8} {'/ empty':>8} {'default /':>9}")
    for name, times in took.items():
        middle = median(times)
        rates = f"{1e3 * middle:8.2f} {1 / middle:8.0f} {sizes[name] / 1e3:8.1f}"
        print(f"{name:36} {rates} {middle / empty:8.1f} {default / middle:9.1f}")


if __name__ == "__main__":
    main()
