"""A source with a wrong address says in words what was found and what helps, and never a password."""

import socket
import ssl
import subprocess
from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import Path

import databases
import httpx
import pytest
from monitoring_server import START, Page, Server, building_file
from receivers import webhook_server
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.tables import Building
from service.records.source_poller import SourcePoller
from service.records.sources.problems import unreachable
from service.records.tables import SourceState
from service.settings import Settings

NOW = START + timedelta(days=1)
SETTINGS = Settings(http_timeout=0.5, http_retries=1, retry_delay=0.01, settle_time=0)


@pytest.fixture
def refused() -> str:
    """An address of this machine at which no server listens."""
    with socket.create_server(("127.0.0.1", 0)) as door:
        return f"http://127.0.0.1:{door.getsockname()[1]}/"


@pytest.fixture(scope="module")
def tls(tmp_path_factory: pytest.TempPathFactory) -> ssl.SSLContext:
    """An untrusted certificate."""
    folder = tmp_path_factory.mktemp("tls")
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-days", "2"]
    subprocess.run([*made, "-keyout", "key.pem", "-out", "cert.pem"], cwd=folder, check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "cert.pem", folder / "key.pem")
    return context


@pytest.fixture
def database(tmp_path: Path) -> Iterator[sessionmaker[Session]]:
    from service.db import sessions as opened

    url = databases.sqlite(tmp_path)
    made = opened.sessions(url)
    yield made
    made.kw["bind"].dispose()


def error(sessions: sessionmaker[Session], kind: str, location: str, now: datetime = NOW, more: str = "") -> str:
    """Stored state after a poll of such a source."""
    with sessions.begin() as session:
        building = building_store.add(session, building_file(kind, location, more), Path("/"), now)
        number = building.id
    SourcePoller(sessions, SETTINGS, lambda: now, lambda _: None).poll("TOWER")
    with sessions() as session:
        assert session.get_one(Building, number).code == "TOWER"
        state = session.get_one(SourceState, number)
        assert state.failing_since == now
        assert state.error is not None
        return state.error


@pytest.mark.parametrize("kind", ["archive", "fdsnws"])
def test_a_refused_connection(database: sessionmaker[Session], kind: str, refused: str) -> None:
    printed = error(database, kind, refused)
    assert "cannot be reached: the connection is refused, as no server listens at this port, 2 times" in printed
    assert printed.endswith("check that the server runs, and the host and port of location in the building file")


def test_an_unknown_host() -> None:
    try:
        try:
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")
        except OSError as system:
            raise httpx.ConnectError(str(system)) from system
    except httpx.ConnectError as raised:
        found, helps = unreachable("it", raised)
    assert found == "it cannot be reached: its name is not known"
    assert "check location in the building file" in helps


@pytest.mark.parametrize(
    ("status", "helps"),
    [
        (401, "answered 401 Unauthorized; the user name or the password is missing or wrong; correct it in location"),
        (403, "answered 403 Forbidden; the server denies access"),
        (404, "answered 404 Not Found; nothing is served at this path; correct location"),
        (410, "answered 410 Gone; correct location in the building file"),
    ],
)
def test_an_archive_that_refuses(database: sessionmaker[Session], server: Server, status: int, helps: str) -> None:
    server.pages["/events/"] = Page(status=status)
    address = server.address.replace("http://", "http://alice:s3cret@")
    printed = error(database, "archive", f"{address}/events/?token=t0ken")
    assert printed.startswith(f"{server.address}/events/ {helps}")
    assert not any(secret in printed for secret in ("alice", "s3cret", "t0ken"))


def test_a_certificate_that_is_not_trusted(database: sessionmaker[Session], tls: ssl.SSLContext) -> None:
    with webhook_server(tls) as receiver:
        printed = error(database, "archive", f"{receiver.address}/events/")
    assert "its TLS certificate is not trusted (self-signed certificate)" in printed
    assert "give the server a certificate for this host that is trusted here" in printed


def test_tls_at_a_port_without_it(database: sessionmaker[Session], server: Server) -> None:
    printed = error(database, "archive", server.address.replace("http://", "https://") + "/")
    assert "it does not speak TLS at this port" in printed
    assert "http:// in place of https://" in printed


def test_a_server_without_fdsn_web_services(database: sessionmaker[Session], server: Server) -> None:
    server.is_fdsn = False
    printed = error(database, "fdsnws", server.address)
    assert printed.startswith(
        f"{server.address} is not an FDSN server: nothing is served at /fdsnws/dataselect/1/version"
    )


def test_a_web_site_in_place_of_an_fdsn_server(database: sessionmaker[Session], server: Server) -> None:
    server.pages["/fdsnws/station/1/query"] = Page(b"<!DOCTYPE html><title>Log in</title>")
    printed = error(database, "fdsnws", server.address)
    assert "answered with an HTML page ('Log in') in place of StationXML: this is not an FDSN server" in printed


def test_a_catalogue_that_is_none(database: sessionmaker[Session], server: Server) -> None:
    printed = error(database, "fdsnws", server.address, more=f'catalogue = "{server.address}/events"')
    assert "/events has no FDSN event service" in printed
    assert "correct catalogue in the building file" in printed


def test_an_address_that_an_earlier_version_accepted(database: sessionmaker[Session]) -> None:
    with database.begin() as session:
        building = building_store.add(session, building_file("archive", "http://127.0.0.1:1/"), Path("/"), NOW)
        revision = building_store.current(session, building)
        revision.toml, revision.parsed = revision.toml.replace("http://127.0.0.1:1/", "htp:/x"), None
        number = building.id
    SourcePoller(database, SETTINGS, lambda: NOW, lambda _: None).poll("TOWER")
    with database() as session:
        printed = session.get_one(SourceState, number).error
    assert printed == (
        "location in the building file: this is not a web address: it begins with 'htp:'; http://host/path and "
        "https://host/path are allowed"
    )
