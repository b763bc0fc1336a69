"""The page of a building's drift and its pictures: what people see of a loss, with units and data behind it."""

import re
from html import unescape

import pytest
import stored_histories
from api_client import client
from building_models import BASE
from sqlalchemy.orm import Session, sessionmaker

pytestmark = pytest.mark.sqlite

PAGE = "/buildings/PAPER/drift"


def test_the_page_shows_what_was_expected_and_what_came(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    with client(database_url) as api:
        assert "Monitoring begins with the first analysed event" in api.get(PAGE).text
        stored_histories.store_and_monitor(
            sessions, building, stored_histories.store_history(26, onset=21), stored_histories.start(27)
        )
        assert f'href="{PAGE}"' in api.get("/buildings/PAPER").text
        page = unescape(api.get(PAGE).text)
        cell, change = r"<td[^>]*>", r"−\d\.\d+ % \(95 %: −\d\.\d+ to −\d\.\d+ %\)"
        assert re.search(f"<tr><td>stiffness, direction x{cell}sudden{cell}{change}<td", page), page
        assert "Latest event with a value, against the expected value (± one standard deviation)" in page
        assert re.search(r'<small><a href="/events/\d+">event \d+</a></small>', page)
        assert f"{stored_histories.start(21):%Y-%m-%d}" in page
        assert "before it can raise an alarm" in page
        assert BASE in page
        sections = re.findall(r"<h3>([^<]+)</h3>.*?<details( open)?>", page, re.DOTALL)
        opened = [title for title, is_open in sections if is_open]
        assert opened == ["Stiffness of the isolation layer", "Damping of the isolation layer"]
        pictures = re.findall(r'<img src="(/charts/[^"]+)"', page)
        data = re.findall(r'<a href="(/api/[^"]+)"', page)
        assert len(pictures) == 4 + 6  # curves of stiffness, damping and two modes; histories of six quantities
        for address in [*pictures, *data]:
            assert api.get(address).status_code == 200, address
        drawn = api.get("/charts/baseline.svg?building=PAPER&quantity=stiffness&subject=x")
        for words in ("equivalent stiffness (kN/mm)", "amplitude (mm)", "the latest event"):
            assert words in drawn.text
        for quantity, name in (("k_eq", "equivalent stiffness (kN/mm)"), ("c_eq", "equivalent damping (kN s/mm)")):
            among = f"/charts/cycles.csv?event=26&direction=x&quantity={quantity}"
            expected, *cycles = api.get(among).text.split("\r\n\r\n")
            assert expected.startswith(f"amplitude (mm),expected {name},from,to"), expected[:80]
            assert len(expected.splitlines()) == 1 + 80
            assert len(cycles) == 2  # those of all others, and those of this earthquake
        history = api.get("/charts/drift.svg?building=PAPER&quantity=stiffness").text
        assert "change (%)" in history
        assert re.search(r"sudden −\d\.\d %", history)
        assert "change (mm)" in api.get("/charts/drift.svg?building=PAPER&quantity=residual_displacement").text
        again = api.get("/charts/drift.svg?building=PAPER&quantity=gain")
        known = {"If-None-Match": again.headers["ETag"]}
        assert api.get("/charts/drift.svg?building=PAPER&quantity=gain", headers=known).status_code == 304


def test_the_result_for_both_directions_is_shown_beside_each(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    """A loss in both."""
    found = stored_histories.store_history_in_both(26, onset=24, loss=0.05)
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    stored_histories.store_and_monitor(sessions, building, found, stored_histories.start(27))
    with client(database_url) as api:
        page = unescape(api.get(PAGE).text)
        row = re.search(r"<tr><td>stiffness, both.*?\n(?=<tr>|</tbody>)", page, re.DOTALL)
        assert row, page
        cells = re.sub(r"<[^>]+>", " ", row[0])
        assert re.search(r"−\d\.\d+ % \(95 %: −\d\.\d+ to −\d\.\d+ %\)", cells), cells
        (alarm,) = [
            one
            for one in api.get("/api/v1/buildings/PAPER/drift-alarms").json()["items"]
            if (one["quantity"], one["subject"]) == ("stiffness", "xy")
        ]
        assert alarm["low"] < -0.05 < alarm["high"] < 0
        for event in alarm["events"]:
            assert f'<a href="/events/{event}">{event}</a>' in row[0]
        values = api.get("/api/v1/buildings/PAPER/drift?quantity=stiffness&subject=xy&format=csv").text.splitlines()
        assert len(values) == 1 + len(found)
        watched = api.get("/api/v1/buildings/PAPER/watched").json()["items"]
        assert ("stiffness", "xy", 26) in [(one["quantity"], one["subject"], one["events"]) for one in watched]
        assert api.get("/api/v1/buildings/PAPER/baseline?quantity=stiffness&subject=xy").json()["items"] == []
        drawn = api.get("/charts/drift.svg?building=PAPER&quantity=stiffness").text
        assert drawn.index("direction x") < drawn.index("direction y") < drawn.index("both directions")
        for address in re.findall(r'<img src="(/charts/[^"]+)"', page):
            assert api.get(address).status_code == 200, address


def test_what_is_not_there_is_not_drawn(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        stored_histories.building(session)
    with client(database_url) as api:
        for address in (
            "/buildings/NONE/drift",
            "/charts/drift.svg?building=PAPER&quantity=gain",
            "/charts/baseline.svg?building=PAPER&quantity=gain&subject=x",
            "/charts/baseline.svg?building=PAPER&quantity=stiffness&subject=x",
        ):
            assert api.get(address).status_code == 404, address
