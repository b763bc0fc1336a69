"""The pages of a building's earthquakes: the list of all, and one with what came of it."""

from collections.abc import Iterator
from datetime import timedelta
from html import unescape

import assessed_buildings
import pytest
from alert_candidates import DAY, START
from alert_fixtures import analysed, building, earthquake
from api_client import client
from sqlalchemy.orm import Session, sessionmaker

from service.analyses.pages import LISTED
from service.buildings.tables import Building
from service.records.tables import Event

pytestmark = pytest.mark.sqlite


@pytest.fixture
def stored(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions() as session:
        yield session


@pytest.fixture
def of(stored: Session) -> Building:
    return building(stored)


def shown(url: str, session: Session, address: str) -> str:
    """A page, as it reads."""
    session.commit()
    with client(url) as api:
        answer = api.get(address)
    assert answer.status_code == 200, answer.text
    return unescape(answer.text)


def test_the_list_shows_what_each_earthquake_did(database_url: str, stored: Session, of: Building) -> None:
    moved = earthquake(stored, of, START, 0.0237)
    unmeasured = earthquake(stored, of, START + DAY, None)
    useless = earthquake(stored, of, START + 2 * DAY)
    analysed(stored, useless, START + 2 * DAY, refusal="the base slab's record is missing")
    page = shown(database_url, stored, f"/buildings/{of.code}/events")
    lines = [line for line in page.splitlines() if "/events/" in line and "<tr" in line]
    for event, line in zip((useless, unmeasured, moved), lines, strict=True):
        assert f'"/events/{event.id}"' in line
    assert "It could not be used: the base slab's record is missing" in lines[0]
    assert "<td>23.7<td>1,200<td" in lines[2]
    assert "<td><td>1,200<td" in lines[1]
    assert "50.0" in lines[2]


def test_the_list_goes_on_where_a_page_ends(database_url: str, stored: Session, of: Building) -> None:
    made = [earthquake(stored, of, START + number * timedelta(hours=1)) for number in range(LISTED + 2)]
    first = shown(database_url, stored, f"/buildings/{of.code}/events")
    [following] = [part.split('"')[0] for part in first.split('href="') if "cursor=" in part.split('"')[0]]
    second = shown(database_url, stored, following)
    for event in made:
        assert (f'"/events/{event.id}"' in first) != (f'"/events/{event.id}"' in second)
    assert 'rel="next"' not in second


def test_an_earthquake_leads_to_those_before_and_after_it_at_its_building(
    database_url: str, stored: Session, of: Building
) -> None:
    """Two events at the same time are distinguished, and another building's do not appear."""
    elsewhere = building(stored)
    made = [earthquake(stored, of, START + number * DAY) for number in (0, 1, 1, 2)]
    earthquake(stored, elsewhere, START + DAY)
    assert [_neighbours(shown(database_url, stored, f"/events/{one.id}")) for one in made] == [
        _expected(made, number) for number in range(len(made))
    ]


def _neighbours(page: str) -> tuple[int | None, int | None]:
    links = {kind: part for part in page.split("<a ") for kind in ("prev", "next") if f'rel="{kind}"' in part}
    before, after = (links.get(kind) for kind in ("prev", "next"))
    return _number(before), _number(after)


def _number(link: str | None) -> int | None:
    return None if link is None else int(link.split("/events/")[1].split('"')[0])


def _expected(made: list[Event], number: int) -> tuple[int | None, int | None]:
    before, after = made[:number][-1:], made[number + 1 :][:1]
    return before[0].id if before else None, after[0].id if after else None


def test_a_rejected_earthquake_shows_the_reason(database_url: str, stored: Session, of: Building) -> None:
    event = earthquake(stored, of, START)
    analysed(stored, event, START, refusal="the base slab's record is missing")
    page = shown(database_url, stored, f"/events/{event.id}")
    assert "It could not be used</strong>: the base slab's record is missing" in page


def test_an_earthquake_that_no_one_knows_is_not_found(database_url: str, stored: Session, of: Building) -> None:
    stored.commit()
    with client(database_url) as api:
        assert api.get("/events/1").status_code == 404
        assert api.get("/buildings/NONE/events").status_code == 404


def test_a_building_without_an_earthquake_says_so(database_url: str, stored: Session, of: Building) -> None:
    assert "No earthquake has been recorded yet." in shown(database_url, stored, f"/buildings/{of.code}/events")


def test_an_earthquake_shows_its_strength_where_it_was_computed(database_url: str, stored: Session) -> None:
    of = assessed_buildings.building(stored)
    event = assessed_buildings.earthquake(stored, of, START + DAY)
    former = earthquake(stored, of, START + 2 * DAY)
    page = shown(database_url, stored, f"/events/{event.id}")
    for line in (
        'Peak velocity, horizontal<td class="number">5.00 cm/s',
        'JMA instrumental intensity (unofficial)<td class="number">3.0',
        'Long-period motion (unofficial)<td class="number">class 1, 8.00 cm/s',
        'Arias intensity<td class="number">0.0100 m/s',
        'direction y<td class="number">90.0 gal at 0.05',
    ):
        assert line in page
    assert "Strength of the earthquake" not in shown(database_url, stored, f"/events/{former.id}")
    with client(database_url) as api:
        shaking = api.get(f"/api/v1/events/{event.id}").json()["shaking"]
        assert api.get(f"/api/v1/events/{former.id}").json()["shaking"] is None
    assert (shaking["intensity"], shaking["pgv"], shaking["duration"]) == (3.0, 0.05, 20.0)
    assert len(shaking["periods"]) == len(shaking["spectrum"]["x"]) == 47
    assert shaking["floors"][0]["level"] == shaking["storeys"][0]["level"] == "roof"
