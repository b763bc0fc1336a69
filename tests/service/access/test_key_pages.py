"""Keys by the API and by their page: made, limited and revoked by admins of all buildings alone."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import paper_records
import pytest
from accessible import problems
from api_client import TestClient, client
from api_server import OWN, api_server
from browsers import needs_chromium
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service.access import keys
from service.access.roles import Role
from service.access.tables import ApiKey, AuditEntry
from service.buildings import store as building_store

pytestmark = pytest.mark.sqlite

NOW = datetime(2024, 1, 1, tzinfo=UTC)
KEYS = "/api/v1/keys"


@pytest.fixture
def admin(sessions: sessionmaker[Session], tmp_path: Path) -> str:
    text = paper_records.building_file()
    with sessions.begin() as session:
        for code in ("PAPER", "OTHER"):
            building_store.add(session, text.replace("PAPER", code), tmp_path, NOW)
        return keys.create(session, "admin", Role.admin, NOW)


def codes(api: TestClient, key: str) -> list[str]:
    answer = api.get("/api/v1/buildings", headers={"X-API-Key": key})
    return [one["code"] for one in answer.json()["items"]] if answer.status_code == 200 else []


def test_a_key_is_made_limited_and_revoked_by_the_api(
    database_url: str, sessions: sessionmaker[Session], admin: str
) -> None:
    with client(database_url, visitor=None) as api:
        own = {"X-API-Key": admin}
        wanted = {"name": "duty", "role": "viewer", "higher": {"PAPER": "engineer"}, "days": 20}
        answer = api.post(KEYS, json=wanted, headers=own)
        assert (answer.status_code, answer.headers["cache-control"]) == (201, "no-store")
        made = answer.json()
        key, number = made.pop("key"), made["id"]
        assert codes(api, key) == ["OTHER", "PAPER"]
        listed = {one["name"]: one for one in api.get(KEYS, headers=own).json()["items"]}
        assert listed["duty"] == made | {"used_at": listed["duty"]["used_at"]}
        assert set(listed) == {"admin", "duty"}
        narrow = api.patch(f"{KEYS}/{number}", json={"buildings": ["OTHER"], "days": 5}, headers=own).json()
        assert (narrow["buildings"], narrow["higher"]) == (["OTHER"], {})
        assert timedelta(days=4) < datetime.fromisoformat(narrow["expires_at"]) - datetime.now(UTC) < timedelta(days=5)
        for more in (
            {"buildings": ["PAPER"]},
            {"buildings": ["OTHER", "PAPER"]},
            {"days": 10},
            {"buildings": ["NONE"]},
        ):
            assert api.patch(f"{KEYS}/{number}", json=more, headers=own).status_code == 409, "never more than it had"
        assert codes(api, key) == ["OTHER"]
        assert api.delete(f"{KEYS}/{number}", headers=own).json()["revoked_at"] is not None
        assert codes(api, key) == []
        assert api.patch(f"{KEYS}/{number}", json={"days": 1}, headers=own).status_code == 409, "it has ended"
        assert api.delete(f"{KEYS}/99", headers=own).status_code == 404
    with sessions() as session:
        trail = session.scalars(select(AuditEntry).order_by(AuditEntry.id)).all()
        assert [(one.by, one.action) for one in trail] == [("admin", one) for one in ("POST", "PATCH", "DELETE")]
        assert key not in str([vars(one) for table in (AuditEntry, ApiKey) for one in session.query(table)])


@pytest.mark.parametrize(
    ("wanted", "status"),
    [
        ({"name": "admin", "role": "viewer"}, 409),
        ({"name": "link:a", "role": "viewer"}, 409),
        ({"name": "a", "role": "viewer", "buildings": ["NONE"]}, 409),
        ({"name": "a", "role": "engineer", "higher": {"PAPER": "viewer"}}, 409),
        ({"name": "a", "role": "king"}, 422),
        ({"name": "a", "role": "viewer", "buildings": []}, 422),
        ({"name": "a", "role": "viewer", "days": 0}, 422),
        ({"name": "a\nb", "role": "viewer"}, 422),
        ({"name": "a", "role": "viewer", "hash": "b"}, 422),
    ],
)
def test_a_key_of_no_use_is_not_made(database_url: str, admin: str, wanted: dict[str, object], status: int) -> None:
    with client(database_url, visitor=None) as api:
        assert api.post(KEYS, json=wanted, headers={"X-API-Key": admin}).status_code == status
        assert len(api.get(KEYS, headers={"X-API-Key": admin}).json()["items"]) == 1


def test_an_admin_of_some_buildings_makes_no_keys(
    database_url: str, sessions: sessionmaker[Session], admin: str
) -> None:
    """Else they could make one of all buildings for themselves."""
    with sessions.begin() as session:
        some = keys.create(session, "some", Role.admin, NOW, buildings=["PAPER"])
        mixed = keys.create(session, "mixed", Role.engineer, NOW, higher={"PAPER": Role.admin})
    wanted = {"name": "a", "role": "admin"}
    with client(database_url, visitor=None) as api:
        for key in (some, mixed):
            headers = {"X-API-Key": key}
            assert api.post(KEYS, json=wanted, headers=headers).status_code == 403
            assert api.post("/keys", data=wanted, headers=headers).status_code == 403
            assert api.patch(f"{KEYS}/1", json={"days": 1}, headers=headers).status_code == 403
            assert api.delete(f"{KEYS}/1", headers=headers).status_code == 403
            for path in (KEYS, "/keys"):
                assert api.get(path, headers=headers).status_code == 403
            assert 'href="/keys"' not in api.get("/", headers=headers).text
        assert 'href="/keys"' in api.get("/", headers={"X-API-Key": admin}).text


def test_a_page_of_another_site_makes_no_key(database_url: str, admin: str) -> None:
    with client(database_url, visitor=None) as browser:
        browser.post("/login", data={"key": admin})
        wanted = {"name": "a", "role": "admin"}
        for path in ("/keys", "/keys/1/revoke", "/keys/1/limit", "/buildings/PAPER/links"):
            assert browser.post(path, data=wanted, headers={"Origin": "http://evil.example"}).status_code == 403
        assert codes(browser, admin) == ["OTHER", "PAPER"]


@pytest.mark.slow
@needs_chromium
def test_the_page_of_keys_works_without_javascript(database_url: str, admin: str) -> None:
    with api_server(database_url, visitor=None, public_url=OWN) as address, chromium() as browser:
        page = browser.new_context(java_script_enabled=False).new_page()
        page.goto(f"{address}/keys")
        page.get_by_label("API key").fill(admin)
        page.get_by_role("button", name="Log in").click()
        page.get_by_label("Who or what uses it").fill("duty")
        page.get_by_label("Higher roles").fill("PAPER=king")
        page.get_by_role("button", name="Make it").click()
        assert "Choose 'viewer', 'engineer' or 'admin'" in page.locator(".wrong").text_content()
        page.get_by_label("Higher roles").fill("PAPER=engineer")
        page.get_by_label("Its buildings, by").fill("PAPER, OTHER")
        page.get_by_role("button", name="Make it").click()
        assert page.locator("pre").text_content().startswith("mk_")
        page.get_by_role("link", name="All keys").click()
        row = page.locator("tr", has_text="duty")
        assert "viewer, engineer of PAPER" in row.text_content()
        row.locator("summary").click()
        row.get_by_label("Buildings that remain").fill("OTHER")
        with page.expect_navigation():
            row.get_by_role("button", name="Limit it").click()
        assert "engineer" not in row.text_content()
        assert "never" not in page.locator("tr", has_text="admin").locator("[data-of='Last used']").text_content()

        looked_at = browser.new_context(storage_state=page.context.storage_state()).new_page()
        looked_at.goto(f"{address}/keys")
        assert problems(looked_at) == []
        with page.expect_navigation():
            page.get_by_role("button", name="Revoke duty").click()
        assert "revoked" in row.text_content()
