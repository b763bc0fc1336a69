"""The real building gives the same stored results from its folder and from a server of FDSN web services."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import obspy
import pytest
from cached_executor import CachedExecutor
from shared_data import BNCS, needs_shared
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.analyses.tables import Analysis, DirectionResult
from service.buildings import store as building_store
from service.db.blobs import decode
from service.demo.server import Archive, application, listening
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.records.polling import SourcePoller
from service.records.tables import Event
from service.settings import Settings

pytestmark = [needs_shared, pytest.mark.slow]


def forces(sessions: sessionmaker[Session]) -> list[np.ndarray]:
    """The current force of every event, earliest first."""
    with sessions() as session:
        rows = session.scalars(
            select(DirectionResult)
            .join(Analysis)
            .join(Event)
            .where(Analysis.current)
            .order_by(Event.start)
            .options(undefer(DirectionResult.force))
        )
        return [decode(row.force) for row in rows]


def test_folder_and_fdsn_web_services(sessions: sessionmaker[Session]) -> None:
    settings = Settings(workers=1, event_grace=0)
    archive = Archive(obspy.read_inventory(BNCS / "station.xml"), list(obspy.read(BNCS / "*.mseed")))
    text = (BNCS / "building.toml").read_text()
    with listening(application(archive)) as address:
        server = text.replace('kind = "folder"', 'kind = "fdsnws"').replace('location = "."', f'location = "{address}"')
        with sessions.begin() as session:
            building_store.add(session, text, BNCS, datetime.now(UTC))
            building_store.add(
                session, server.replace('code = "BNCS"', 'code = "SERVED"'), Path("/"), datetime.now(UTC)
            )
        SourcePoller(sessions, settings).poll_all()
    assert Worker(sessions, CachedExecutor, settings, KINDS).run_until_idle() == 8  # and a look for drift at each
    found = forces(sessions)
    assert len(found) == 6
    for from_folder, from_server in zip(found[::2], found[1::2], strict=True):
        np.testing.assert_array_equal(from_folder, from_server)
