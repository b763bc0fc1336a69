"""Who may use the API."""

from datetime import UTC, datetime

import pytest
from asking import client
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import Role, digest
from service.database import ApiKey

NOW = datetime(2024, 1, 1, tzinfo=UTC)
BUILDINGS = "/api/v1/buildings"


@pytest.mark.parametrize(
    ("host", "name", "headers", "status"),
    [
        ("127.0.0.1", "localhost:8000", {}, 200),
        ("::1", "[::1]:8000", {}, 200),
        ("192.0.2.7", "127.0.0.1:8000", {}, 403),
        ("127.0.0.1", "rebound.example", {}, 403),
        ("127.0.0.1", "127.0.0.1:8000", {"X-Forwarded-For": "127.0.0.1"}, 403),
        ("192.0.2.7", "127.0.0.1:8000", {"X-Forwarded-For": "127.0.0.1"}, 403),
    ],
)
def test_without_a_key_only_this_machine_is_answered(
    database_url: str, host: str, name: str, headers: dict[str, str], status: int
) -> None:
    with client(database_url, host, name) as asking:
        for path in (BUILDINGS, "/", "/docs", "/fdsnws/dataselect/1/version"):
            assert asking.get(path, headers=headers).status_code == status, path


def test_with_a_key_everybody_needs_one(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "dashboard", Role.viewer, NOW)
    with client(database_url) as asking:
        assert asking.get(BUILDINGS).status_code == 401
        assert asking.get(BUILDINGS, headers={"X-API-Key": key[:-1]}).status_code == 401
        assert asking.get(BUILDINGS, headers={"X-API-Key": key}).status_code == 200
        assert asking.get(BUILDINGS, headers={"Authorization": f"Bearer {key}"}).status_code == 200
        analyse = asking.post("/api/v1/events/1/analyses", json={}, headers={"X-API-Key": key})
    assert analyse.status_code == 403
    assert "role engineer" in analyse.json()["detail"]


def test_a_revoked_key_is_worthless(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        old, new = (keys.create(session, name, Role.viewer, NOW) for name in ("old", "new"))
    with sessions.begin() as session:
        keys.revoke(session, "old", NOW)
    with client(database_url) as asking:
        assert asking.get(BUILDINGS, headers={"X-API-Key": old}).status_code == 401
        assert asking.get(BUILDINGS, headers={"X-API-Key": new}).status_code == 200


def test_the_key_itself_is_not_stored(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "one", Role.admin, NOW)
    with sessions() as session:
        stored = session.get_one(ApiKey, 1).hash
    assert stored == digest(key)
    assert key not in stored


def test_a_page_of_another_site_changes_nothing(database_url: str) -> None:
    with client(database_url) as asking:
        answer = asking.post("/api/v1/events/1/analyses", json={}, headers={"Origin": "http://evil.example"})
    assert answer.status_code == 403
