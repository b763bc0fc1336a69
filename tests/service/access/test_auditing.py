"""The audit trail has everything that a person changed, with the change or not at all, and no secret."""

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import monitored_building
import paper_records
import pytest
from api_client import client
from click.testing import Result
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker
from typer.testing import CliRunner

from service.access import keys
from service.access.auditing import AuditContext, audited, without_secrets
from service.access.auth import Role
from service.access.tables import AuditEntry
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.cli import app

NOW = datetime(2024, 1, 1, tzinfo=UTC)
COMMANDS = Path(__file__).resolve().parents[3] / "service" / "cli"


def entries(sessions: sessionmaker[Session]) -> list[tuple[str, str, str, str, dict[str, Any]]]:
    with sessions() as session:
        found = session.scalars(select(AuditEntry).order_by(AuditEntry.id))
        return [(one.by, one.address, one.action, one.target, one.details) for one in found]


@pytest.fixture
def key(sessions: sessionmaker[Session], tmp_path: Path) -> str:
    """An engineer's, of a service with a building."""
    with sessions.begin() as session:
        building_store.add(session, monitored_building.building_file(tmp_path), tmp_path, NOW)
        return keys.create(session, "Jo", Role.engineer, NOW)


def test_what_a_person_changes_by_the_api_is_kept(database_url: str, sessions: sessionmaker[Session], key: str) -> None:
    body = {"direction": "x", "change": "mine", "effects": {"hysteresis": {}}}
    with client(database_url, host="192.0.2.7") as api:
        api.headers["X-API-Key"] = key
        assert api.post("/api/v1/buildings/PAPER/models", json={"direction": "x"}).status_code == 201
        assert api.post("/api/v1/buildings/PAPER/models", json=body | {"effects": {"no": {}}}).status_code == 409
        assert api.get("/api/v1/buildings").status_code == 200
    target = "/api/v1/buildings/PAPER/models"
    assert entries(sessions) == [("Jo", "192.0.2.7", "POST", target, {"direction": "x"})]


def test_what_a_person_changes_by_a_form_is_kept(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building_store.add(session, paper_records.building_file(), Path("/"), NOW)
    with client(database_url) as api:
        assert api.post("/buildings/PAPER/models", data={"direction": "x"}).status_code == 303
        assert api.post("/models/1/accept").status_code == 303
    assert entries(sessions) == [
        ("loopback", "127.0.0.1", "POST", "/buildings/PAPER/models", {"direction": "x"}),
        ("loopback", "127.0.0.1", "POST", "/models/1/accept", {}),
    ]


def test_an_audit_entry_is_stored_only_if_the_change_commits(sessions: sessionmaker[Session]) -> None:
    writing = audited(sessions, lambda: AuditContext("Jo", "here", "POST", "/", {}), lambda: NOW)
    with writing.begin() as session:
        session.scalars(select(Building)).all()
    with writing() as session:
        session.add(Building(code="B", name="", created_at=NOW))
        session.flush()
        session.rollback()
    assert entries(sessions) == []
    with writing.begin() as session:
        session.add(Building(code="B", name="", created_at=NOW))
        session.flush()
    with writing.begin() as session:
        session.scalars(select(Building)).one().name = "tower"
    assert len(entries(sessions)) == 2


def test_commands_that_change_something_are_kept(
    database_url: str, sessions: sessionmaker[Session], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    file = tmp_path / "building.toml"
    file.write_text(paper_records.building_file())

    def run(*words: str) -> Result:
        return CliRunner().invoke(app, list(words))

    assert run("key", "create", "Jo", "--role", "viewer").exit_code == 0
    assert run("key", "list").exit_code == 0
    assert run("building", "add", str(file)).exit_code == 0
    assert run("building", "add", str(file)).exit_code == 1
    assert run("key", "create", "Kim", "--role", "viewer", "--building", "PAPER").exit_code == 0
    found = entries(sessions)
    assert [entry[2].partition(" ")[2] for entry in found] == ["key create", "building add", "key create"]
    assert found[0][4] == {"name": "Jo", "role": "viewer"}
    assert found[2][4] == {"name": "Kim", "role": "viewer", "building": "PAPER"}
    assert all(entry[0] and entry[1] for entry in found)


def test_no_secret_is_kept() -> None:
    reported = {
        "secret": "whsec_1",
        "address": "https://me:word@hooks.example/services/T0/B1?token=3",
        "name": "office",
        "more": [{"api_key": 4}],
        "long": "x" * 1000,
    }
    assert without_secrets(reported) == {
        "secret": "(hidden)",
        "address": "https://hooks.example/...",
        "name": "office",
        "more": [{"api_key": "(hidden)"}],
        "long": "x" * 500,
    }


@pytest.mark.parametrize(
    ("reported", "kept"),
    [
        ({"address": "jo@example.org"}, {"address": "j...@example.org"}),
        ({"address": "o'hara+\u202etag@b\u00fcro.example"}, {"address": "o...@b\u00fcro.example"}),
        ({"address": '"odd name@x"@example.org'}, {"address": '"...@example.org'}),
        ({"address": "https://[me:word@hooks.example"}, {"address": "https://..."}),
        ({"address": "SLACK://token-a/token-b"}, {"address": "SLACK://..."}),
        ({"note": "see https://me:word@x.example/a?token=3 now"}, {"note": "see https://x.example/... now"}),
        ({"note": "ask jo@example.org"}, {"note": "ask jo@example.org"}),
    ],
)
def test_an_address_is_kept_only_in_part(reported: dict[str, str], kept: dict[str, str]) -> None:
    assert without_secrets(reported) == kept


def test_no_command_writes_past_the_trail() -> None:
    writers = [path for path in COMMANDS.rglob("*.py") if re.search(r"\.begin\(\)", path.read_text("utf-8"))]
    assert writers
    assert [path.name for path in writers if "opened(context" not in path.read_text("utf-8")] == []
    assert "yield _audited(context, made)" in (COMMANDS / "database.py").read_text("utf-8")
