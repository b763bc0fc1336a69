"""A process that traces what it does: `python traced_service.py RECEIVER DATABASE FOLDER COMPUTED SERVER`."""

import sys
from datetime import UTC, datetime
from pathlib import Path

import monitored_building
from cached_executor import CachedExecutor
from fastapi.testclient import TestClient
from monitoring_server import building_file
from receivers import webhook_server
from rendered_messages import KEY
from sqlalchemy.orm import Session, sessionmaker

from service import tracing
from service.access import keys
from service.access.roles import Role
from service.alerts.messages import write_messages
from service.app import create
from service.buildings import queries, recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.db.sessions import sessions as opened
from service.notify.notifier import Notifier
from service.records.source_poller import SourcePoller
from service.settings import Settings


def main(receiver: str, database: str, folder: str, computed: str, server: str) -> None:
    """Poll, analyse, deliver and answer."""
    CachedExecutor.folder = Path(computed)
    settings = Settings(
        database_url=database,
        traces={"endpoint": receiver},
        polling={"retries": 0},
        inside_allowed=("localhost",),
        plain_http_allowed=True,
    )
    tracing.begin(settings.traces.endpoint, settings.traces.share, "test")
    sessions = opened(database)
    monitored_building.watch(sessions, Path(folder), monitored_building.earthquakes()[2:3])
    with sessions.begin() as session:
        building_store.add(session, building_file("archive", server), Path("/"), datetime.now(UTC))
        key = keys.create(session, "office", Role.admin, datetime.now(UTC))
    SourcePoller(sessions, settings).poll("TOWER")
    with webhook_server() as program:
        report(sessions, f"{program.address}/s3cret")
        assert Notifier(sessions, settings).run_until_idle() == len(program.posted) == 1
    with TestClient(create(settings)) as api:
        api.headers["Authorization"] = f"Bearer {key}"
        assert api.get("/api/v1/buildings/PAPER?note=s3cret").status_code == 200
        api.get("/login?token=s3cret")
        assert api.get("/healthz").status_code == 200
    tracing.end()
    sessions.kw["bind"].dispose()


def report(sessions: sessionmaker[Session], address: str) -> None:
    """Put a message about the earthquake into the outbox, for a program at this address."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        building, _ = queries.building(session, "PAPER")
        rule = ReceiverRule("program", "webhook", address, KEY, WANTED_KINDS, SEVERITIES)
        recipients.add(session, building.id, rule, "engineer", now)
        write_messages(session, building.id, now - monitored_building.NOW, monitored_building.NOW)


if __name__ == "__main__":
    main(*sys.argv[1:])
