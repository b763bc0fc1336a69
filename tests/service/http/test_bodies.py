"""A stranger's body is not read, and no body is read without limit."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, sleep

import httpx
import psutil
import pytest
from api_server import api_server
from processes import running_command
from raw_http import bytes_accepted, connect, read_response, request_head, response_status
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Role
from service.http.guard import BODY, FDSN_BODY

DRILL = "/api/v1/buildings/B/drill"
SILENCES = "/api/v1/buildings/B/silences"
QUERY = "/fdsnws/dataselect/1/query"
HUGE = 512 * 2**20
MIB = 2**20


@pytest.fixture(scope="module")
def key(stored: sessionmaker[Session]) -> str:
    with stored.begin() as session:
        return keys.create(session, "engineer", Role.engineer, datetime.now(UTC))


@pytest.fixture(scope="module")
def address(url: str, key: str) -> Iterator[str]:
    with api_server(url, visitor=None) as found:
        yield found


@pytest.mark.parametrize("path", [SILENCES, QUERY, "/models/1/accept", "/nothing/here"])
def test_a_stranger_is_refused_by_the_head_alone(address: str, path: str) -> None:
    with connect(address) as connection:
        connection.sendall(request_head("POST", path, Content_Length=HUGE, Content_Type="application/json"))
        assert response_status(connection) == 401, "before a byte of the body was sent"
        assert bytes_accepted(connection, 64 * MIB) < 16 * MIB, "the connection is closed"


@pytest.mark.slow
def test_a_strangers_body_takes_no_memory(url: str, key: str, tmp_path: Path) -> None:
    with running_command(tmp_path, url, "api", "--port", "0") as service:
        output, end = tmp_path / "output", monotonic() + 120
        while not (found := re.search(r"serving at (http://\S+)", output.read_text())):
            assert monotonic() < end, output.read_text()
            sleep(0.1)
        httpx.get(f"{found[1]}/healthz", timeout=60)
        httpx.post(f"{found[1]}{SILENCES}", timeout=60)
        process = psutil.Process(service.pid)
        before = process.memory_info().rss
        for number in range(8):
            with connect(found[1]) as connection:
                connection.sendall(request_head("POST", SILENCES, Content_Length=HUGE))
                bytes_accepted(connection, 64 * MIB, b"[" * 65536)
            assert process.memory_info().rss - before < 32 * MIB, f"after body {number}"


@pytest.mark.parametrize(("path", "most"), [(SILENCES, BODY), (QUERY, FDSN_BODY), ("/buildings/B/silences", BODY)])
@pytest.mark.parametrize("form", ["declared", "chunked"])
def test_a_body_that_is_too_long_is_refused_while_it_comes(
    address: str, key: str, path: str, most: int, form: str
) -> None:
    kind = "application/x-www-form-urlencoded" if path.startswith("/buildings") else "application/json"
    length: dict[str, str | int] = {"Content_Length": HUGE} if form == "declared" else {"Transfer_Encoding": "chunked"}
    with connect(address) as connection:
        connection.sendall(request_head("POST", path, X_API_Key=key, Content_Type=kind, **length))
        piece = b"1" * 4096
        sent = bytes_accepted(connection, most + 8192, piece if form == "declared" else b"1000\r\n" + piece + b"\r\n")
        assert sent > 0
        found = read_response(connection)
    assert found.split()[1] == b"413"
    assert str(most).encode() in found


def test_a_body_as_long_as_may_be_is_read(address: str, key: str) -> None:
    reason = "r" * (BODY - 200)
    wanted = {"pattern": "*", "until": "2030-01-01T00:00:00Z", "reason": reason}
    response = httpx.post(f"{address}{SILENCES}", json=wanted, headers={"X-API-Key": key})
    assert response.status_code == 422, "it was read: its reason is too long"


def test_nested_json_stalls_no_one(address: str, key: str) -> None:
    """30 MiB of `[[],[],...` kept the service from answering for 16 s."""
    for body in (
        b"[" * BODY,
        b"[" + b"[]," * (BODY // 3 - 2) + b"[]]",
        b'{"a":' * (BODY // 5),
        b'{"reason":' + b"[" * 900 + b"]" * 900 + b"}",
    ):
        started = monotonic()
        sent = {"X-API-Key": key, "Content-Type": "application/json"}
        assert httpx.post(f"{address}{SILENCES}", content=body, headers=sent).status_code in (400, 422)
        assert httpx.get(f"{address}/healthz").status_code == 200
        assert monotonic() - started < 5.0


def test_every_response_has_security_headers(address: str, key: str) -> None:
    for path in (
        "/healthz",
        "/api/v1/buildings",
        "/static/menshin.css",
        "/openapi.json",
        "/nothing",
        "/metrics",
        "/login",
    ):
        for headers in ({}, {"X-API-Key": key}):
            response = httpx.get(f"{address}{path}", headers=headers, timeout=60.0)
            assert response.headers["x-content-type-options"] == "nosniff", path
            assert response.headers["x-frame-options"] == "DENY", path
            assert "default-src 'none'" in response.headers["content-security-policy"], path
            assert "server" not in response.headers
