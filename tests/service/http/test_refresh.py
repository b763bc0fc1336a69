"""Pages show what is new by themselves: nothing that is being read moves, and nothing that was typed is lost."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from api_client import client
from api_server import api_server
from assessed_buildings import building_file
from browsers import closing_pages, needs_chromium
from playwright.sync_api import Browser, Page, expect
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service.access import keys
from service.access.auth import REFRESH
from service.access.roles import Role
from service.access.tables import LoginSession
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.records.tables import Event

START = datetime(2024, 1, 1, tzinfo=UTC)
MANY = 60
"""Earthquakes: more than a screen shows."""

pytestmark = pytest.mark.sqlite


def earthquake(session: Session, of: int, day: int) -> None:
    start = START + timedelta(days=day)
    times = {"start": start, "end": start, "created_at": start, "updated_at": start}
    session.add(Event(building_id=of, state="refused", reason="too short", **times))


@pytest.fixture
def tower(sessions: sessionmaker[Session]) -> int:
    with sessions.begin() as session:
        made: Building = building_store.add(session, building_file("TWR"), Path("/"), START)
        session.flush()
        for day in range(MANY):
            earthquake(session, made.id, day)
        return made.id


@pytest.fixture(scope="module")
def started() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def page(started: Browser, database_url: str, tower: int) -> Iterator[Page]:
    with api_server(database_url) as server, closing_pages(started) as browser:
        shown = browser.new_page(viewport={"width": 800, "height": 400})
        shown.goto(server)
        yield shown


@pytest.mark.slow
@needs_chromium
def test_what_is_new_comes_without_moving_what_is_read(page: Page, tower: int, sessions: sessionmaker[Session]) -> None:
    def tops(day: int) -> list[float]:
        row = page.locator("tr", has_text=f"{START + timedelta(days=day):%Y-%m-%d}")
        return [round(one.bounding_box()["y"]) for one in row.all()]  # type: ignore[index]  # it is on the page

    page.goto(f"{page.url}buildings/TWR/events")
    page.locator("tr", has_text=f"{START + timedelta(days=30):%Y-%m-%d}").scroll_into_view_if_needed()
    before = tops(30)
    page.evaluate("refresh()")
    assert tops(30) == before
    with sessions.begin() as session:
        for day in range(MANY, MANY + 5):
            earthquake(session, tower, day)
    page.evaluate("refresh()")
    page.locator("tr", has_text=f"{START + timedelta(days=MANY + 4):%Y-%m-%d}").first.wait_for()
    assert tops(30) == pytest.approx(before, abs=2)

    page.goto(f"{page.url.partition('/events')[0]}/messages")
    page.get_by_text("Add a recipient").click()
    page.get_by_label("Name").fill("the caretaker")
    with sessions.begin() as session:
        session.get_one(Building, tower).name = "Another name"
    page.evaluate("refresh()")
    page.get_by_role("status").wait_for()
    assert page.get_by_label("Name").input_value() == "the caretaker"
    page.get_by_role("button", name="Show what is new").click()
    expect(page.locator("h2").first).to_contain_text("Another name")
    expect(page.get_by_role("status")).not_to_be_visible()


def test_a_browser_that_has_the_page_gets_no_second_copy(database_url: str) -> None:
    with client(database_url) as api:
        answer = api.get("/")
        again = api.get("/", headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["content-security-policy"] == answer.headers["content-security-policy"]


def test_a_page_that_looks_for_news_does_not_keep_a_session_open(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "people", Role.viewer, datetime.now(UTC))
    with client(database_url) as api:
        api.post("/login", data={"key": key})
        long_ago = datetime.now(UTC) - timedelta(minutes=20)
        with sessions.begin() as session:
            session.query(LoginSession).one().used_at = long_ago
        api.app.state.callers.forget()  # type: ignore[attr-defined]  # ours
        assert api.get("/", headers={REFRESH: "1"}).status_code == 200
        assert last_use(sessions) == long_ago
        assert api.get("/").status_code == 200
    assert last_use(sessions) > long_ago


def last_use(sessions: sessionmaker[Session]) -> datetime:
    with sessions() as session:
        return session.query(LoginSession).one().used_at
