"""Pages on a telephone: nothing of a page lies beyond the edge of the screen."""

import pytest
from alert_fixtures import AGE, SOON
from api_server import api_server
from assessed_buildings import STRONG, building, day, earthquake
from browsers import needs_chromium
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service.alerts.messages import write_event_message

WIDTH = 320
"""Pixels."""

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]


@needs_chromium
def test_a_message_and_the_pages_of_managers_fit_a_telephone(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        of = building(session)
        event = earthquake(session, of, day(1), STRONG, quality=("XX.A: 4 spikes were removed from a long record",))
        write_event_message(session, event.id, AGE, event.end + SOON)
    with api_server(database_url) as address, chromium() as browser:
        page = browser.new_page(viewport={"width": WIDTH, "height": 800})
        page.goto(f"{address}/messages/1")
        assert "Displacement as a share of the design displacement" in page.inner_text("main")
        for path in ("/messages/1", "/", f"/buildings/{of.code}"):
            page.goto(f"{address}{path}")
            assert page.evaluate("document.documentElement.scrollWidth") <= WIDTH, path
