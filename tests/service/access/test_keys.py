"""Keys with an end, a last use and buildings, and sessions that read these buildings alone."""

import asyncio
import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import paper_records
import pytest
from api_client import client
from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session, aliased, sessionmaker
from typer.testing import CliRunner

from service.access import keys, scope
from service.access.auditing import AuditContext, audited
from service.access.callers import Callers
from service.access.roles import Caller, Role, digest
from service.access.tables import ApiKey
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.cli import app
from service.db.base import Base
from service.db.sessions import reading
from service.jobs.tables import Lease
from service.records.tables import Event

pytestmark = pytest.mark.sqlite

NOW = datetime(2024, 1, 1, tzinfo=UTC)
BUILDINGS = "/api/v1/buildings"
LIMITED = Caller("of one", Role.admin, frozenset({"PAPER"}))


@pytest.fixture(autouse=True)
def two_buildings(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    """The paper's with an event, and another with two."""
    text = paper_records.building_file()
    with sessions.begin() as session:
        for code, events in (("PAPER", 1), ("OTHER", 2)):
            added = building_store.add(session, text.replace("PAPER", code), tmp_path, NOW)
            session.flush()
            for _ in range(events):
                times = dict.fromkeys(("start", "end", "created_at", "updated_at"), NOW)
                session.add(Event(building_id=added.id, state="gathering", **times))


@pytest.fixture(params=["reading", "writing"])
def limited(request: pytest.FixtureRequest, sessions: sessionmaker[Session]) -> Iterator[Session]:
    context = AuditContext("a", "b", "c", "d", {})
    whole = reading(sessions) if request.param == "reading" else audited(sessions, lambda: context)
    with scope.limited(whole, lambda: LIMITED)() as session:
        yield session


def test_every_table_has_its_limit() -> None:
    """A new table fails here: whoever adds it says which buildings its rows belong to."""
    assert set(Base.metadata.tables.values()) - set(scope.CONDITIONS) == {Lease.__table__}


PAST_THE_LIMIT = {"connection", "raw_connection", "exec_driver_sql"} | {
    f"bulk_{kind}" for kind in ("insert_mappings", "update_mappings", "save_objects")
}
"""Methods by which a statement goes past the session, which adds the limit and the entry of the audit trail."""
WITHOUT_LIMIT = {
    "db/migrate.py": "the version of the tables",
    "db/room.py": "free pages of the file, for a command",
    "db/sessions.py": "BEGIN of a transaction",
    "drift/monitoring.py": "the worker replaces its own values",
    "jobs/queue.py": "the worker renews its own lease",
    "records/originals.py": "who adds bytes reaches the row of these bytes alone",
    "records/polled_together.py": "the poller stores how its own polls ended",
    "transfer/exporting.py": "the isolation of a command's own transaction",
}
"""Modules that use them, and why no caller's limit applies."""


def test_no_statement_goes_past_the_limit() -> None:
    """Whoever adds such a statement says here why no request can reach it with the key of some buildings."""
    folder = Path(scope.__file__).parents[1]
    use = re.compile(rf"\.({'|'.join(PAST_THE_LIMIT)})\b")
    calls = {
        path.relative_to(folder).as_posix() for path in folder.rglob("*.py") if use.search(path.read_text("utf-8"))
    }
    assert calls == set(WITHOUT_LIMIT)


def test_requests_open_the_sessions_of_their_caller_alone() -> None:
    """`app.state.sessions` and `app.state.reading` know of no caller: two dependencies limit them for all routes."""
    folder = Path(scope.__file__).parents[1]
    use = re.compile(r"\bstate\.(sessions|reading)\b")
    users = {
        path.relative_to(folder).as_posix() for path in folder.rglob("*.py") if use.search(path.read_text("utf-8"))
    }
    logins = {"access/pages/__init__.py", "access/pages/links.py", "access/pages/sign_in.py"}
    assert users - logins == {"app.py", "http/parameters.py", "health/api.py"}


def test_no_kind_of_statement_leaves_the_limit(limited: Session) -> None:
    event, building, renamed = Event.__table__, Building.__table__, aliased(Event)
    assert limited.get(Event, 1) is not None
    assert limited.get(Event, 2) is None
    for query in (
        select(Event.id),
        select(renamed.id),
        select(event.c.id),
        select(event.alias().c.id),
        select(event.c.id).join(building, building.c.id == event.c.building_id),
        select(select(Event).subquery().c.id),
        select(renamed.id).outerjoin(Building, Building.id == renamed.building_id),
    ):
        assert limited.scalars(query).all() == [1], query
    assert limited.scalar(select(func.count()).select_from(Event)) == 1
    assert limited.scalar(select(select(Event.id).where(Event.id == 2).exists())) is False
    assert [(one.code, len(one.revisions)) for one in limited.scalars(select(Building))] == [("PAPER", 1)]
    without = select(Building.code, renamed.id).outerjoin(renamed, renamed.id == -1)
    assert limited.execute(without).all() == [("PAPER", None)], "an outer join keeps rows without a partner"


def test_another_buildings_row_is_neither_changed_nor_deleted(sessions: sessionmaker[Session]) -> None:
    with scope.limited(sessions, lambda: LIMITED).begin() as session:
        assert session.execute(update(Event).values(state="refused")).rowcount == 1
        assert session.execute(delete(Event)).rowcount == 1
    with sessions() as session:
        assert session.scalars(select(Event.state)).all() == ["gathering"] * 2


def test_a_caller_who_was_not_admitted_sees_no_building(sessions: sessionmaker[Session]) -> None:
    nobody = Caller("nobody", Role.viewer, frozenset())
    with scope.limited(reading(sessions), lambda: nobody)() as session:
        assert session.scalars(select(Building)).all() == []


def test_a_key_of_some_buildings_is_made_by_the_command_and_sees_them_alone(database_url: str) -> None:
    environment = {"MENSHIN_DATABASE_URL": database_url}
    create = ["key", "create", "tenant", "--role", "viewer", "--days", "10", "--building"]
    refused = CliRunner().invoke(app, [*create, "NONE"], env=environment)
    assert refused.exit_code == 1
    assert "There is no building 'NONE'; 'menshin building list' shows their codes." in refused.output
    key = CliRunner().invoke(app, [*create, "OTHER"], env=environment).output.strip()
    listed = CliRunner().invoke(app, ["key", "list"], env=environment | {"COLUMNS": "200"}).output
    assert "OTHER" in listed
    assert "never" in listed, "not used yet"
    assert "in 9 days" in listed
    with client(database_url) as api:
        api.headers["X-API-Key"] = key
        assert [one["code"] for one in api.get(BUILDINGS).json()["items"]] == ["OTHER"]
        answers = {code: api.get(f"{BUILDINGS}/{code}") for code in ("OTHER", "PAPER", "NONE")}
        assert [one.status_code for one in answers.values()] == [200, 404, 404]
        hidden, absent = (answers[code].json()["detail"].replace(code, "") for code in ("PAPER", "NONE"))
        assert hidden == absent
        end = datetime.fromisoformat(answers["OTHER"].headers["menshin-key-expires"])
        assert timedelta(days=9) < end - datetime.now(UTC) < timedelta(days=10)
        assert 'menshin_events{state="gathering"} 2.0' in api.get("/metrics").text
        assert "Your access ends in 9 days" in api.get("/").text


def test_a_key_has_a_higher_role_on_one_building_alone(database_url: str, sessions: sessionmaker[Session]) -> None:
    environment = {"MENSHIN_DATABASE_URL": database_url, "COLUMNS": "200"}
    create = ["key", "create", "duty", "--role", "viewer"]
    for wrong, problem in (
        ("OTHER=king", "not a building and a role"),
        ("OTHER=viewer", "not higher"),
        ("NONE=admin", "no building 'NONE'"),
    ):
        refused = CliRunner().invoke(app, [*create, "--on", wrong], env=environment)
        assert (refused.exit_code, problem in refused.output) == (1, True), refused.output
    key = CliRunner().invoke(app, [*create, "--on", "OTHER=engineer"], env=environment).output.strip()
    assert "viewer, engineer of OTHER" in CliRunner().invoke(app, ["key", "list"], env=environment).output
    silence = {"pattern": "*", "until": "2100-01-01T00:00:00Z", "reason": "works"}
    with client(database_url) as api:
        api.headers["X-API-Key"] = key
        assert [one["code"] for one in api.get(BUILDINGS).json()["items"]] == ["OTHER", "PAPER"]
        statuses = {
            code: api.post(f"{BUILDINGS}/{code}/silences", json=silence).status_code for code in ("OTHER", "PAPER")
        }
        assert statuses == {"OTHER": 201, "PAPER": 404}
        refused = api.post(f"{BUILDINGS}/PAPER/silences", json=silence).json()["detail"]
        assert "your role there is too low" in refused
        assert "role" not in api.get(f"{BUILDINGS}/NONE").json()["detail"]
        shown = {code: api.get(f"/buildings/{code}/messages").text for code in ("OTHER", "PAPER")}
        assert {code: "Start a drill" in page for code, page in shown.items()} == {"OTHER": True, "PAPER": False}
        receiver = {"name": "b", "kind": "apprise", "address": "json://127.0.0.1/b"}
        assert api.post(f"{BUILDINGS}/OTHER/receivers", json=receiver).status_code == 403
        assert [one["by"] for one in api.get("/api/v1/audit").json()["items"]] == ["duty"], "its own changes"


def test_no_key_has_the_name_of_another_kind_of_caller(sessions: sessionmaker[Session]) -> None:
    for name in ("person:hana", "link:owner"):
        with pytest.raises(keys.KeyNameError, match="does not begin with"), sessions.begin() as session:
            keys.create(session, name, Role.viewer, NOW)


def test_an_expired_key_no_longer_works_and_its_sessions_end(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    end = datetime.now(UTC) + timedelta(hours=1)  # until the database says otherwise
    with sessions.begin() as session:
        key = keys.create(session, "guest", Role.viewer, NOW, expires_at=end)
        lasting = keys.create(session, "lasting", Role.viewer, NOW)
    with client(database_url) as browser, client(database_url) as api:
        assert browser.post("/login", data={"key": key}).status_code == 303
        assert browser.get("/").status_code == 200
        with sessions.begin() as session:
            session.execute(update(ApiKey).where(ApiKey.name == "guest").values(expires_at=datetime.now(UTC)))
        browser.app.state.callers.forget()
        assert browser.get("/").headers["location"].startswith("/login")
        assert api.get(BUILDINGS, headers={"X-API-Key": key}).status_code == 401
        assert api.post("/login", data={"key": key}).status_code == 401
        answer = api.get(BUILDINGS, headers={"X-API-Key": lasting})
        assert answer.status_code == 200
        assert "menshin-key-expires" not in answer.headers


def test_the_last_use_is_written_once_a_minute(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = digest(keys.create(session, "dashboard", Role.viewer, NOW))

    async def used() -> list[datetime | None]:
        now = NOW
        callers = Callers(sessions, timedelta(hours=12), timedelta(days=7), lambda: 1e3 * now.timestamp(), lambda: now)
        stored = []
        for _ in range(5):
            await callers.known()
            callers.note_use(key)
            await asyncio.gather(*callers.touches())
            with sessions() as session:
                stored.append(session.scalar(select(ApiKey.used_at)))
            now += timedelta(seconds=25)
        return stored

    times = [(one - NOW).total_seconds() for one in asyncio.run(used()) if one is not None]
    assert times == [0, 0, 0, 75, 75]
