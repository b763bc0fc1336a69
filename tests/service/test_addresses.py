"""Passwords and tokens of sources are in nothing that is shown or stored to be shown."""

import logging
from datetime import timedelta
from pathlib import Path

import httpx
import pytest
from api_server import api_server
from hypothesis import given, seed, strategies as st
from monitoring_server import START, Page, building_file, miniseed, monitoring_server, stream
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.addresses import without_credentials
from service.alerts import periodic_checks
from service.alerts.tables import Alert, AlertChange
from service.buildings import store as building_store
from service.notify.tables import Message
from service.records.source_poller import SourcePoller
from service.records.tables import FetchedFile, Recording, SourceState
from service.settings import Settings

NOW = START + timedelta(days=1)
SETTINGS = Settings(http_timeout=0.5, http_retries=0, source_patience=60)
NAME, PASSWORD, TOKEN = "observer", "pa%3Bss-wOrd", "t0ken-of-the-owner"
SHOWN = (SourceState, Recording, Alert, AlertChange, Message)
SECRETS = (NAME, PASSWORD, "pa;ss-wOrd", TOKEN)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("https://h.example/a/b", "https://h.example/a/b"),
        ("https://me:secret@h.example:8443/a?token=x#y", "https://h.example:8443/a"),
        ("https://me:se@cret@h.example", "https://h.example"),
        ("see http://h.example/a?token=x, 3 times", "see http://h.example/a, 3 times"),
        ("(http://me@[::1]:80/a?b); ok", "(http://[::1]:80/a); ok"),
        ("/folder/of?records@home", "/folder/of?records@home"),
        ("no address: // at all", "no address: // at all"),
    ],
)
def test_an_address_is_cut_down_to_what_may_be_shown(text: str, shown: str) -> None:
    assert without_credentials(text) == shown
    assert without_credentials(shown) == shown


@seed(1)
@given(st.text(st.characters(categories=["L", "N"]), min_size=1), st.text(), st.text())
def test_a_token_never_stays(token: str, before: str, after: str) -> None:
    found = without_credentials(f"{before} http://x/?token=~{token}~ {after}")
    assert f"~{token}~" not in found or f"~{token}~" in before + after


def add(sessions: sessionmaker[Session], location: str) -> None:
    with sessions.begin() as session:
        building_store.add(session, building_file("archive", location), Path("/"), NOW)


def stored_as_text(sessions: sessionmaker[Session]) -> str:
    """Everything in the tables that people are shown."""
    with sessions() as session:
        rows = [row for table in SHOWN for row in session.scalars(select(table))]
        return "\n".join(str({key: value for key, value in vars(row).items() if key != "cursor"}) for row in rows)


def test_no_password_of_a_source_is_stored_shown_or_logged(
    database_url: str, sessions: sessionmaker[Session], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    logging.getLogger("httpx").setLevel(logging.WARNING)  # as service.roles sets it
    with monitoring_server() as server:
        server.pages["/events/"] = Page(b"a.mseed\nb.mseed\nc.mseed?key=" + TOKEN.encode())
        server.add("/events/a.mseed", miniseed(stream()))
        server.pages["/events/b.mseed"] = Page(b"", promised=2 * 10**9)
        server.pages["/events/c.mseed"] = Page(b"no record")
        location = f"{server.address}/events/?token={TOKEN}".replace("//", f"//{NAME}:{PASSWORD}@")
        add(sessions, location)
        SourcePoller(sessions, SETTINGS, clock=lambda: NOW).poll_all()
        assert all("Basic " in headers["Authorization"] for _, headers in server.requested)
        assert any(TOKEN in path for path, _ in server.requested)
        server.pages["/events/"] = Page(b"", status=403)
        SourcePoller(sessions, SETTINGS, clock=lambda: NOW + timedelta(minutes=1)).poll_all()
    SourcePoller(sessions, SETTINGS, clock=lambda: NOW + timedelta(minutes=2)).poll_all()
    periodic_checks.check_buildings(sessions, SETTINGS, NOW + timedelta(hours=1))
    with sessions() as session:
        assert {row.name: row.state for row in session.scalars(select(Recording))} == {
            "a.mseed": "read",
            "b.mseed": "refused",
            "c.mseed": "refused",
        }
        state = session.scalars(select(SourceState)).one()
        assert "cannot be reached" in (state.error or "")
        assert PASSWORD not in str(state.cursor)
        files = session.scalars(select(FetchedFile.address).order_by(FetchedFile.address)).all()
        assert files == [f"{server.address}/events/{n}" for n in ("a.mseed", "b.mseed", f"c.mseed?key={TOKEN}")]
    assert not [secret for secret in SECRETS if secret in stored_as_text(sessions)]
    with api_server(database_url) as address, httpx.Client(base_url=address) as api:
        pages = [api.get(path).text for path in ("/api/v1/sources", "/api/v1/alerts", "/alerts")]
    assert "cannot be reached" in pages[0]
    shown = "\n".join([*pages, *(record.getMessage() for record in caplog.records), caplog.text])
    assert not [secret for secret in SECRETS if secret in shown]
