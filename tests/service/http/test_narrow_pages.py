"""Pages on a telephone: nothing of a message lies beyond the edge of the screen."""

from shutil import which

import pytest
from alert_fixtures import AGE, SOON
from api_server import api_server
from assessed_buildings import building, day, earthquake
from playwright.sync_api import sync_playwright
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.messages import write_event_message

WIDTH = 375
"""Pixels."""

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]


@pytest.mark.skipif(which("chromium") is None, reason="no Chromium to look at it with")
def test_a_message_fits_a_telephone(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        event = earthquake(session, building(session), day(1))
        write_event_message(session, event.id, AGE, event.end + SOON)
    with api_server(database_url) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=which("chromium"))
        page = browser.new_page(viewport={"width": WIDTH, "height": 800})
        page.goto(f"{address}/messages/1")
        assert "Displacement as a share of the design displacement" in page.inner_text("main")
        assert page.evaluate("document.documentElement.scrollWidth") <= WIDTH
        browser.close()
