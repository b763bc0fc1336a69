"""Links to one building: what they show, what they never show, and how they end."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import paper_records
import pytest
from accessible import problems
from api_client import TestClient, client
from api_server import OWN, api_server
from browsers import needs_chromium
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium
from typer.testing import CliRunner

from service.access import keys, links
from service.access.auth import COOKIE, LINK, SAFE_LINK
from service.access.logins import ATTEMPTS
from service.access.roles import Role
from service.access.tables import AuditEntry, BuildingLink
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.cli import app

pytestmark = pytest.mark.sqlite

NOW = datetime(2024, 1, 1, tzinfo=UTC)
PUBLIC = "http://127.0.0.1:8000"


@pytest.fixture(autouse=True)
def two_buildings(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    text = paper_records.building_file()
    with sessions.begin() as session:
        for code in ("PAPER", "OTHER"):
            building_store.add(session, text.replace("PAPER", code), tmp_path, NOW)


@pytest.fixture
def token(sessions: sessionmaker[Session]) -> str:
    with sessions.begin() as session:
        building = session.scalars(select(Building).where(Building.code == "PAPER")).one()
        return links.create(session, building, "owner", "root", datetime.now(UTC))[1]


def admin_of(sessions: sessionmaker[Session], *codes: str) -> dict[str, str]:
    with sessions.begin() as session:
        name = "-".join(codes) or "all"
        return {"X-API-Key": keys.create(session, name, Role.admin, NOW, buildings=codes or None)}


def follow(browser: TestClient, token: str) -> int:
    return browser.get("/link", params={"token": token}).status_code


def test_a_link_shows_one_building_and_changes_nothing(
    database_url: str, sessions: sessionmaker[Session], token: str
) -> None:
    with client(database_url, visitor=None) as browser:
        answer = browser.get("/link", params={"token": token})
        assert answer.status_code == 200
        assert '<meta http-equiv="refresh" content="0; url=/buildings/PAPER">' in answer.text
        assert (answer.headers["referrer-policy"], answer.headers["cache-control"]) == ("no-referrer", "no-store")
        assert token not in answer.text
        (cookie,) = answer.headers.get_list("set-cookie")
        assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
        assert COOKIE not in browser.cookies, "no session begins"
        assert browser.get("/buildings/PAPER").status_code == 200
        assert browser.get("/buildings/OTHER").status_code == 404
        assert "OTHER" not in browser.get("/").text
        assert [one["code"] for one in browser.get("/api/v1/buildings").json()["items"]] == ["PAPER"]
        silence = {"pattern": "*", "until": "2100-01-01T00:00:00Z", "reason": "works"}
        assert browser.post("/api/v1/buildings/PAPER/silences", json=silence).status_code == 403
        assert browser.get("/api/v1/audit").status_code == 403
        assert browser.get("/buildings/PAPER/links").status_code == 403
        assert browser.post("/login", data={"key": token}).status_code == 401, "it is no key"
        assert browser.get("/", headers={"X-API-Key": token}).status_code == 303
        assert browser.post("/logout").status_code == 303
        assert browser.get("/buildings/PAPER").status_code == 303
    with client(database_url, visitor=None) as browser:
        browser.cookies.set(COOKIE, token)
        assert browser.get("/buildings/PAPER").status_code == 303, "it is no session either"
    with sessions() as session:
        assert not any(token in str(vars(one)) for table in (BuildingLink, AuditEntry) for one in session.query(table))


def test_over_https_only_the_safe_cookie_counts(database_url: str, token: str) -> None:
    with client(database_url, visitor=None, scheme="https") as browser:
        (cookie,) = browser.get("/link", params={"token": token}).headers.get_list("set-cookie")
        assert cookie.startswith(f"{SAFE_LINK}=")
        assert "Secure" in cookie.split("; ")
        browser.cookies.clear()
        assert browser.get("/buildings/PAPER", headers={"Cookie": f"{LINK}={token}"}).status_code == 303
        assert browser.get("/buildings/PAPER", headers={"Cookie": f"{SAFE_LINK}={token}"}).status_code == 200


def test_a_link_never_replaces_a_login(database_url: str, sessions: sessionmaker[Session], token: str) -> None:
    """Else whoever sends an admin a link logs them out, or has them act as a viewer."""
    with sessions.begin() as session:
        key = keys.create(session, "people", Role.admin, NOW)
    with client(database_url, visitor=None) as browser:
        browser.post("/login", data={"key": key})
        assert follow(browser, token) == 200
        assert browser.get("/buildings/OTHER").status_code == 200


@pytest.mark.parametrize("column", ["revoked_at", "expires_at"])
def test_a_link_ends_and_with_it_every_browser(
    database_url: str, sessions: sessionmaker[Session], token: str, column: str
) -> None:
    with client(database_url, visitor=None) as browser:
        assert follow(browser, token) == 200
        assert browser.get("/buildings/PAPER").status_code == 200
        with sessions.begin() as session:
            session.execute(update(BuildingLink).values({column: datetime.now(UTC)}))
        browser.app.state.callers.forget()
        assert browser.get("/buildings/PAPER").status_code == 303
        answer = browser.get("/link", params={"token": token})
        assert answer.status_code == 401
        assert "has ended, was revoked" in answer.text
        assert answer.headers["referrer-policy"] == "no-referrer"
    with sessions() as session:
        assert session.scalars(select(BuildingLink)).one().used_at is not None


def test_whoever_guesses_waits(database_url: str) -> None:
    with client(database_url, visitor=None) as browser:
        statuses = [follow(browser, f"mv_{number}") for number in range(ATTEMPTS + 1)]
    assert statuses == [401] * ATTEMPTS + [429]


def test_an_admin_of_the_building_makes_and_revokes_links(database_url: str, sessions: sessionmaker[Session]) -> None:
    own, other = admin_of(sessions, "PAPER"), admin_of(sessions, "OTHER")
    path = "/api/v1/buildings/PAPER/links"
    with client(database_url, visitor=None, public_url=PUBLIC) as api:
        assert api.post(path, json={"name": "a"}, headers=other).status_code == 404
        made = api.post(path, json={"name": "owner", "days": 10}, headers=own)
        assert (made.status_code, made.headers["cache-control"]) == (201, "no-store")
        link = made.json()
        end = datetime.fromisoformat(link["expires_at"]) - datetime.now(UTC)
        assert timedelta(days=9) < end <= timedelta(days=10)
        token = link["address"].removeprefix(f"{PUBLIC}/link?token=")
        (listed,) = api.get(path, headers=own).json()["items"]
        assert listed == {name: one for name, one in link.items() if name != "address"}
        assert api.delete(f"/api/v1/links/{link['id']}", headers=other).status_code == 404
        assert follow(api, token) == 200
        assert "Your access ends in 9 days" in api.get("/buildings/PAPER").text
        assert api.delete(f"/api/v1/links/{link['id']}", headers=own).json()["revoked_at"] is not None
        assert follow(api, token) == 401
        for wrong in ({"name": "a", "days": 0}, {"name": "a", "days": 9999}, {"name": ""}, {"name": "a", "code": "b"}):
            assert api.post(path, json=wrong, headers=own).status_code == 422, wrong
    with sessions() as session:
        trail = [(one.by, one.action, one.details) for one in session.scalars(select(AuditEntry))]
    assert ("PAPER", "POST", {"name": "owner", "days": 10}) in trail
    assert token not in str(trail)


def test_the_command_makes_lists_and_revokes_links(database_url: str) -> None:
    environment = {"MENSHIN_DATABASE_URL": database_url, "COLUMNS": "200", "MENSHIN_PUBLIC_URL": PUBLIC}

    def run(*words: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, ["key", *words], env=environment)
        return done.exit_code, done.output

    assert run("link", "NONE", "owner") == (1, "There is no building 'NONE'.\n")
    address = run("link", "PAPER", "owner", "--days", "3")[1].strip()
    token = address.removeprefix(f"{PUBLIC}/link?token=")
    with client(database_url, visitor=None) as browser:
        assert follow(browser, token) == 200
        listed = run("links")[1]
        assert "owner" in listed
        assert "in 2 days" in listed
        assert token not in listed
        assert run("unlink", "1") == (0, "The link for 'owner' is revoked.\n")
        assert follow(browser, token) == 401
    assert run("unlink", "7")[0] == 1


@pytest.mark.slow
@needs_chromium
def test_the_page_of_links_works_without_javascript(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "people", Role.admin, NOW)
    with api_server(database_url, visitor=None, public_url=OWN) as address, chromium() as browser:
        page = browser.new_context(java_script_enabled=False).new_page()
        page.goto(f"{address}/buildings/PAPER/links")
        page.get_by_label("API key").fill(key)
        page.get_by_role("button", name="Log in").click()
        page.get_by_label("Person or purpose").fill("the owner")
        page.get_by_role("button", name="Make it").click()
        made = page.locator("pre").text_content()
        with page.expect_navigation():
            page.get_by_role("link", name="All links to PAPER").click()
        assert page.locator("tbody tr").count() == 1

        guest = browser.new_page()
        guest.goto(made)
        guest.wait_for_url(f"{address}/buildings/PAPER")
        assert guest.evaluate("document.referrer") == "", "the token is in no address that is passed on"
        looked_at = browser.new_context(storage_state=page.context.storage_state()).new_page()
        looked_at.goto(f"{address}/buildings/PAPER/links")
        assert problems(looked_at) == []

        with page.expect_navigation():
            page.get_by_role("button", name="Revoke the link for the owner, 1").click()
        assert "revoked" in page.locator("tbody tr").text_content()
