"""The memory of a source's files outlives the process that fetched them, and is not part of the cursor."""

from datetime import timedelta
from pathlib import Path

from monitoring_server import START, Page, building_file, miniseed, monitoring_server, stream
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.buildings import store as building_store
from service.records.recordings import Fetched, remember
from service.records.source_poller import SourcePoller
from service.records.sources.source import Known
from service.records.tables import FetchedFile, Recording, SourceState
from service.settings import Settings

NOW = START + timedelta(days=1)
SETTINGS = Settings(http_timeout=0.5, http_retries=1, retry_delay=0.01)


def test_a_body_that_broke_off_is_kept_until_the_rest_has_come(sessions: sessionmaker[Session]) -> None:
    data = miniseed(stream())
    with monitoring_server() as server:
        server.pages["/events/"] = Page(b"a.mseed")
        page = server.add("/events/a.mseed", data)
        page.breaks_after, page.breaks = 1_000, 1 + SETTINGS.polling.retries
        with sessions.begin() as session:
            building_store.add(session, building_file("archive", f"{server.address}/events/"), Path("/"), NOW)
        SourcePoller(sessions, SETTINGS, clock=lambda: NOW).poll_all()
        with sessions() as session:
            kept = session.scalars(select(FetchedFile).options(undefer(FetchedFile.beginning))).one()
            assert (kept.mark, kept.beginning) == (None, data[:2_000])
            assert session.scalars(select(Recording)).all() == []
        SourcePoller(sessions, SETTINGS, clock=lambda: NOW).poll_all()
        assert server.requested[-1][1]["Range"] == "bytes=2000-"
    with sessions() as session:
        taken = session.scalars(select(FetchedFile).options(undefer(FetchedFile.beginning))).one()
        assert (taken.mark, taken.version, taken.beginning) == ("", None, None)
        assert session.scalars(select(Recording)).one().state == "read"
        assert "a.mseed" not in str(session.scalars(select(SourceState)).one().cursor)


def test_files_of_one_building_are_not_anothers(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        here = building_store.add(session, building_file(), Path("/"), NOW)
        other = building_store.add(session, building_file().replace('code = "TOWER"', 'code = "OTHER"'), Path("/"), NOW)
        remember(session, here, [Known("/a", "1"), Known("/b", "1")])
        remember(session, here, [Known("/a", "2")])
    assert Fetched(sessions, here.id).known(["/a", "/c"]) == {"/a": Known("/a", "2")}
    assert Fetched(sessions, other.id).known(["/a"]) == {}
