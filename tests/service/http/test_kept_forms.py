"""In a browser: what was typed into a page's forms outlives another form's refusal, and a session that has ended."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import databases
import pytest
from alert_fixtures import raise_softening
from api_server import api_server
from browsers import closing_pages, needs_chromium
from monitoring_server import building_file
from playwright.sync_api import Browser, Page
from sqlalchemy import delete
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service.access import keys
from service.access.auth import Role
from service.access.tables import LoginSession
from service.buildings import store as building_store
from service.db import sessions as opened

pytestmark = [
    pytest.mark.slow,
    needs_chromium,
]


@pytest.fixture
def sessions(tmp_path: Path) -> Iterator[sessionmaker[Session]]:
    url = databases.sqlite(tmp_path)
    made = opened.sessions(url)
    with made.begin() as session:
        raise_softening(
            session, building_store.add(session, building_file("folder", str(tmp_path)), tmp_path, datetime.now(UTC))
        )
    yield made
    made.kw["bind"].dispose()


@pytest.fixture(scope="module")
def started() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def page(started: Browser, sessions: sessionmaker[Session]) -> Iterator[Page]:
    """The page of an alert, of a person who has logged in."""
    with sessions.begin() as session:
        key = keys.create(session, "engineer", Role.engineer, datetime.now(UTC))
    url = sessions.kw["bind"].url.render_as_string(hide_password=False)
    with api_server(url, visitor=None) as address, closing_pages(started) as browser:
        made, printed = browser.new_page(), []
        made.on("console", lambda message: printed.append(message.text) if message.type == "error" else None)
        made.goto(f"{address}/alerts/1")
        log_in(made, key)
        made.key = key  # type: ignore[attr-defined]
        yield made
        refusals = [one for one in printed if "Failed to load resource" not in one]  # what a status of 401 or 409 makes
    assert refusals == [], "the browser refused something"


def log_in(page: Page, key: str) -> None:
    page.get_by_label("API key").fill(key)
    with page.expect_navigation():
        page.get_by_role("button", name="Log in").click()


def acknowledging(page: Page) -> str:
    return page.locator("#acknowledge-note").input_value()


def ending(page: Page) -> tuple[str, str]:
    return page.locator("#inspect-note").input_value(), page.locator("#inspect-outcome").input_value()


def type_all(page: Page, acknowledging: str) -> None:
    page.locator("#inspect-note").fill("two bearings <replaced>")
    page.locator("#inspect-outcome").select_option("unfounded")
    page.locator("#acknowledge-note").fill(acknowledging)


def test_a_refused_form_leaves_the_others_as_they_were(page: Page) -> None:
    type_all(page, "  ")
    with page.expect_navigation():
        page.get_by_role("button", name="Acknowledge").click()
    assert page.get_by_text("Not accepted.").is_visible()
    assert ending(page) == ("two bearings <replaced>", "unfounded")
    page.locator("#acknowledge-note").fill("on my way")
    with page.expect_navigation():
        page.get_by_role("button", name="Acknowledge").click()
    assert page.locator("#acknowledge-note").count() == 0
    assert ending(page) == ("two bearings <replaced>", "unfounded"), "and so does one that was taken"
    page.reload()
    assert ending(page) == ("", "confirmed"), "it is kept for one page"


def test_what_was_typed_is_there_again_after_the_login_that_an_ended_session_takes(
    page: Page, sessions: sessionmaker[Session]
) -> None:
    type_all(page, "on my way")
    with sessions.begin() as session:
        session.execute(delete(LoginSession))
    page.wait_for_timeout(1200)  # what a process remembers of logins
    with page.expect_navigation():
        page.get_by_role("button", name="Acknowledge").click()
    assert page.get_by_text("Nothing was done.").is_visible()
    assert page.get_by_text("What you typed is kept in this tab").is_visible()
    with page.expect_navigation():
        page.get_by_role("link", name="Log in and go on").click()
    log_in(page, page.key)  # type: ignore[attr-defined]
    page.wait_for_url("**/alerts/1")
    assert acknowledging(page) == "on my way"
    assert ending(page) == ("two bearings <replaced>", "unfounded")
    kept = page.evaluate("() => Object.values(sessionStorage).join()")
    assert kept == ""
    assert page.get_by_text("active", exact=False).first.is_visible(), "nothing was done"


def test_a_form_that_was_taken_is_not_filled_again_and_no_secret_is_kept(page: Page) -> None:
    address = page.url.replace("/alerts/1", "/buildings/TOWER/alerts")
    page.goto(address)
    page.get_by_text("Mute alerts for a while").click()
    page.locator("#silence-pattern").fill("stiffness")
    page.locator("#silence-hours").fill("12")
    page.locator("#silence-reason").fill("a load test")
    with page.expect_navigation():
        page.get_by_role("button", name="Mute").click()
    assert page.get_by_role("cell", name="a load test").is_visible()
    assert page.locator("#silence-reason").input_value() == ""
    page.evaluate("""() => {
        const [form] = [...document.forms].filter((one) => one.querySelector("#silence-reason"));
        for (const [name, type] of [["secret", "text"], ["p", "password"]])
            form.insertAdjacentHTML("beforeend", `<input name="${name}" type="${type}" value="hunter2">`);
        document.addEventListener("submit", (event) => event.preventDefault());
        form.noValidate = true;
        form.requestSubmit();
    }""")
    kept = page.evaluate("() => Object.values(sessionStorage).join()")
    assert "silence" in kept
    assert "hunter2" not in kept
