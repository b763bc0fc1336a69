"""A process that traces what it does: `python traced_service.py RECEIVER DATABASE FOLDER COMPUTED SERVER`."""

import sys
from datetime import UTC, datetime
from pathlib import Path

import monitored_building
from cached_executor import CachedExecutor
from fastapi.testclient import TestClient
from monitoring_server import building_file

from service import tracing
from service.access import keys
from service.access.roles import Role
from service.app import create
from service.buildings import store as building_store
from service.db.sessions import sessions as opened
from service.records.source_poller import SourcePoller
from service.settings import Settings


def main(receiver: str, database: str, folder: str, computed: str, server: str) -> None:
    """Poll, analyse and answer."""
    CachedExecutor.folder = Path(computed)
    settings = Settings(database_url=database, traces={"endpoint": receiver}, polling={"retries": 0})
    tracing.begin(settings.traces.endpoint, settings.traces.share, "test")
    sessions = opened(database)
    monitored_building.watch(sessions, Path(folder), monitored_building.earthquakes()[2:3])
    with sessions.begin() as session:
        building_store.add(session, building_file("archive", server), Path("/"), datetime.now(UTC))
        key = keys.create(session, "office", Role.admin, datetime.now(UTC))
    SourcePoller(sessions, settings).poll("TOWER")
    with TestClient(create(settings)) as api:
        api.headers["Authorization"] = f"Bearer {key}"
        assert api.get("/api/v1/buildings/PAPER?note=s3cret").status_code == 200
        api.get("/login?token=s3cret")
        assert api.get("/healthz").status_code == 200
    tracing.end()
    sessions.kw["bind"].dispose()


if __name__ == "__main__":
    main(*sys.argv[1:])
