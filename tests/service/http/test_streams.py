"""A stream ends with the key of whoever reads it, and with the server."""

from collections.abc import Iterator
from datetime import UTC, datetime
from time import monotonic, sleep

import httpx
import pytest
from api_server import api_server
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Role
from service.buildings.tables import Building
from service.http.guard import STREAMS
from service.jobs.tables import Job

NOW = datetime(2024, 1, 1, tzinfo=UTC)
PATIENCE = 60.0
"""s for which a stream without news goes on."""


@pytest.fixture(scope="module")
def address(url: str, stored: sessionmaker[Session]) -> Iterator[str]:
    with stored.begin() as session:
        building = Building(code="B", name="tower", created_at=NOW)
        session.add(building)
        session.flush()
        session.add(Job(kind="watch", building_id=building.id, arguments={}, state="waiting", created_at=NOW))
    with api_server(url, visitor=None, progress_patience=PATIENCE) as found:
        yield f"{found}/api/v1/jobs/1/progress"


def test_it_ends_when_the_key_is_revoked(address: str, stored: sessionmaker[Session]) -> None:
    with stored.begin() as session:
        key = keys.create(session, "reader", Role.viewer, NOW)
    with httpx.stream("GET", address, headers={"X-API-Key": key}, timeout=30) as stream:
        assert stream.status_code == 200
        lines = stream.iter_lines()
        assert any(line.startswith("data: ") for line in lines)
        with stored.begin() as session:
            keys.revoke(session, "reader", NOW)
        started = monotonic()
        list(lines)
        assert monotonic() - started < PATIENCE / 4


def test_one_caller_has_so_many_and_no_more(address: str, stored: sessionmaker[Session]) -> None:
    with stored.begin() as session:
        key = keys.create(session, "greedy", Role.viewer, NOW)
    sleep(1.1)  # for which a process remembers the keys
    with httpx.Client(headers={"X-API-Key": key}, timeout=30) as api:
        open_ones = [api.send(api.build_request("GET", address), stream=True) for _ in range(STREAMS + 1)]
        assert [one.status_code for one in open_ones] == [200] * STREAMS + [429]
        assert api.get(address.removesuffix("/progress")).status_code == 200, "requests have a share of their own"
        for one in open_ones:
            one.close()
