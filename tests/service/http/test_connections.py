"""Connections that send nothing, too slowly, or take nothing are closed, and there are never too many."""

import logging
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from time import monotonic, sleep

import httpx
import pytest
from api_server import api_server
from raw_http import connect, request_head, response_status
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Role
from service.http.connections import TimeLimits
from service.http.server import MOST, WINDOW, Throttle

QUICK = TimeLimits(head=1.0, body=1.0, answer=1.0, next=1.0, linger=0.5)
MOST_CONNECTIONS = 20
SILENCES = "/api/v1/buildings/B/silences"
LATEST = 9.0
"""s, in which a connection is closed whose patience is 1 s, on a machine with other work; by default the service
waits at least 10 s for a head, a body, or a client that takes no answer."""


@pytest.fixture(scope="module")
def key(stored: sessionmaker[Session]) -> str:
    with stored.begin() as session:
        return keys.create(session, "engineer of connections", Role.engineer, datetime.now(UTC))


@pytest.fixture(scope="module")
def address(url: str, key: str) -> Iterator[str]:
    with api_server(url, visitor=None, time_limits=QUICK, max_connections=MOST_CONNECTIONS) as found:
        assert httpx.get(f"{found}/healthz", timeout=30).status_code == 200
        yield found


def lasts(connection: socket.socket, dripping: bytes = b"", *, reads: bool = True) -> float:
    """s until the other side closes, while a byte is sent every tenth of a second."""
    started = monotonic()
    connection.settimeout(0.1)
    while monotonic() - started < 2 * LATEST:
        try:
            if dripping:
                connection.sendall(dripping)
            if not reads:
                sleep(0.1)
            elif not connection.recv(65536):
                break
        except TimeoutError:
            continue
        except ConnectionError:
            break
    return monotonic() - started


@pytest.mark.parametrize(
    ("first", "dripping"),
    [
        (b"", b""),
        (b"", b"G"),
        (b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n", b"X"),
        (request_head("GET", "/healthz"), b""),
        (request_head("GET", "/healthz"), b"G"),
    ],
    ids=["silent", "slow line", "slow head", "idle after an answer", "slow second head"],
)
def test_a_head_that_does_not_come_is_not_waited_for(address: str, first: bytes, dripping: bytes) -> None:
    with connect(address) as connection:
        connection.sendall(first)
        assert 0.5 < lasts(connection, dripping) < LATEST


def test_a_body_that_does_not_come_is_not_waited_for(address: str, key: str) -> None:
    with connect(address) as connection:
        connection.sendall(
            request_head("POST", SILENCES, X_API_Key=key, Content_Length=10_000, Content_Type="text/plain")
        )
        assert 0.5 < lasts(connection, b"x") < LATEST


def test_a_body_that_no_one_needs_is_not_waited_for(address: str) -> None:
    with connect(address) as connection:
        connection.sendall(request_head("POST", SILENCES, Content_Length=10_000))
        assert response_status(connection) == 401
        assert lasts(connection, b"x") < LATEST


def test_an_answer_that_is_not_taken_is_given_up(address: str, key: str) -> None:
    """Thousands of responses are requested, and none is read."""
    with connect(address) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.sendall(request_head("GET", "/openapi.json") * 1000)
        assert 0.5 < lasts(connection, b"G", reads=False) < LATEST


def test_a_body_does_not_wait_until_its_head_is_acknowledged(address: str) -> None:
    """Clients acknowledge a head without its body after 40 ms."""
    times = []
    with httpx.Client(base_url=address) as client:
        for _ in range(40):
            started = monotonic()
            assert client.get("/static/menshin.css").status_code == 200
            times.append(monotonic() - started)
    assert min(times[20:]) < 0.03, "clients acknowledge only the first heads at once"


def test_silent_connections_keep_no_one_out(address: str) -> None:
    with ExitStack() as stack:
        for _ in range(3 * MOST_CONNECTIONS):
            stack.enter_context(connect(address))
        assert httpx.get(f"{address}/healthz").status_code == 200, "the longest silent one made room"


def test_where_all_are_being_answered_one_more_is_reported_to_come_again(address: str, key: str) -> None:
    with ExitStack() as stack:
        for _ in range(MOST_CONNECTIONS):
            busy = stack.enter_context(connect(address))
            busy.sendall(request_head("POST", SILENCES, X_API_Key=key, Content_Length=10, Content_Type="text/plain"))
        sleep(0.3)
        with connect(address) as more:
            assert response_status(more) == 503
    end = monotonic() + LATEST
    while status_of(address) != 200:
        assert monotonic() < end, "they are gone, and their places are free"


def status_of(address: str) -> int:
    with connect(address) as connection:
        connection.sendall(request_head("GET", "/healthz"))
        return response_status(connection)


def test_a_log_that_an_attacker_writes_stays_short(caplog: pytest.LogCaptureFixture) -> None:
    now = [0.0]
    log = logging.getLogger("test of the throttle")
    log.addFilter(Throttle(lambda: now[0]))
    for second in (0.0, WINDOW + 1):
        now[0] = second
        for number in range(1000):
            log.warning("nonsense from %d", number)
    assert len(caplog.messages) == 2 * MOST
    assert "995 more such lines were omitted" in caplog.messages[MOST]
