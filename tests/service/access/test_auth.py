"""Authentication at the API."""

from datetime import UTC, datetime

import pytest
from api_client import client
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Caller, Role, digest
from service.access.tables import ApiKey

pytestmark = pytest.mark.sqlite

NOW = datetime(2024, 1, 1, tzinfo=UTC)
BUILDINGS = "/api/v1/buildings"


ANYWHERE = [
    ("127.0.0.1", "localhost:8000", {}),
    ("::1", "[::1]:8000", {}),
    ("192.0.2.7", "127.0.0.1:8000", {}),
    ("127.0.0.1", "rebound.example", {}),
    ("127.0.0.1", "127.0.0.1:8000", {"X-Forwarded-For": "127.0.0.1"}),
]
PATHS = (BUILDINGS, "/", "/docs", "/fdsnws/dataselect/1/version", "/metrics")


@pytest.mark.parametrize(("host", "name", "headers"), ANYWHERE)
@pytest.mark.parametrize("ever", ["no key yet", "the only key revoked"])
def test_without_a_key_no_one_is_answered_wherever_the_request_seems_to_come_from(
    database_url: str, sessions: sessionmaker[Session], ever: str, host: str, name: str, headers: dict[str, str]
) -> None:
    """A proxy on this machine may send `Host: 127.0.0.1` and hide its client."""
    if ever == "the only key revoked":
        with sessions.begin() as session:
            keys.create(session, "first", Role.admin, NOW)
            keys.revoke(session, "first", NOW)
    with client(database_url, host, name, visitor=None) as api:
        answers = {path: api.get(path, headers=headers) for path in PATHS}
        assert {path: one.status_code for path, one in answers.items()} == dict.fromkeys(PATHS, 401) | {
            "/": 303,
            "/docs": 303,
        }
        assert "menshin key create" in answers[BUILDINGS].json()["detail"]
        assert api.post("/api/v1/buildings/B/drill", headers=headers).status_code == 401


@pytest.mark.parametrize(
    ("host", "name", "headers", "status"),
    [(*one, 200 if number < 2 else 401) for number, one in enumerate(ANYWHERE)],
)
def test_a_demonstration_shows_itself_to_what_seems_to_be_this_machine_until_there_is_a_key(
    database_url: str, sessions: sessionmaker[Session], host: str, name: str, headers: dict[str, str], status: int
) -> None:
    visitor = Caller("visitor", Role.engineer)
    with client(database_url, host, name, visitor=visitor) as api:
        assert api.get(BUILDINGS, headers=headers).status_code == status
        assert api.delete("/api/v1/receivers/1", headers=headers).status_code == (403 if status == 200 else 401)
    with sessions.begin() as session:
        keys.create(session, "first", Role.admin, NOW)
        keys.revoke(session, "first", NOW)
    with client(database_url, host, name, visitor=visitor) as api:
        assert api.get(BUILDINGS, headers=headers).status_code == 401


def test_with_a_key_everybody_needs_one(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "dashboard", Role.viewer, NOW)
    with client(database_url) as api:
        assert api.get(BUILDINGS).status_code == 401
        assert api.get(BUILDINGS, headers={"X-API-Key": key[:-1]}).status_code == 401
        assert api.get(BUILDINGS, headers={"X-API-Key": key}).status_code == 200
        assert api.get(BUILDINGS, headers={"Authorization": f"Bearer {key}"}).status_code == 200
        analyse = api.post("/api/v1/events/1/analyses", json={}, headers={"X-API-Key": key})
    assert analyse.status_code == 403
    assert "role engineer" in analyse.json()["detail"]


def test_a_revoked_key_is_worthless(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        old, new = (keys.create(session, name, Role.viewer, NOW) for name in ("old", "new"))
    with sessions.begin() as session:
        keys.revoke(session, "old", NOW)
    with client(database_url) as api:
        assert api.get(BUILDINGS, headers={"X-API-Key": old}).status_code == 401
        assert api.get(BUILDINGS, headers={"X-API-Key": new}).status_code == 200


def test_the_key_itself_is_not_stored(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "one", Role.admin, NOW)
    with sessions() as session:
        stored = session.get_one(ApiKey, 1).hash
    assert stored == digest(key)
    assert key not in stored


def test_a_page_of_another_site_changes_nothing(database_url: str) -> None:
    with client(database_url) as api:
        answer = api.post("/api/v1/events/1/analyses", json={}, headers={"Origin": "http://evil.example"})
    assert answer.status_code == 403
