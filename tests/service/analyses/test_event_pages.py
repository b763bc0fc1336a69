"""The pages of a building's earthquakes: the list of all, and one with what came of it."""

import re
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
from service.jobs.tables import Job
from service.records.tables import Event

pytestmark = pytest.mark.sqlite
READ = re.compile(
    r'(?:title|alt|aria-label|placeholder)="([^"]*)"|<(?:style|script|code)\b.*?</\w+>|<[^>]*>', re.DOTALL
)
"""Attributes that people read, and what they do not read."""
ENGLISH = re.compile(r"(?<![\w/.\[_:'\"-])(?!gal\b|mm\b|roof\b|ground\b)[a-z]{3,}(?![\w/\]_(=.'-])|\b[A-Z][a-z]{3,}\b")
NAMES = {"Menshin", "English", "UTC", "Tower", "Hall", "Asia", "Tokyo", "smoother", "cms", "test"}


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


def test_the_japanese_pages_of_earthquakes_and_jobs_have_no_english(
    database_url: str, stored: Session, of: Building
) -> None:
    moved = earthquake(stored, of, START, 0.0237)
    refused = earthquake(stored, of, START + DAY)
    reason = (
        "XX.T.01.HNX: every sample is 0 (SI); check the sensor and its cable. The channel is left out; direction x: "
        "the base slab's acceleration cannot be used; nothing can be estimated without it"
    )
    analysed(stored, refused, START + DAY, refusal=reason)
    progress = {"done": 0, "stages": 1, "doing": "Analysing the event", "share": 0.0}
    job = Job(kind="analyse", event_id=moved.id, arguments={}, state="done", progress=progress, created_at=START)
    waiting = Job(kind="analyse", event_id=moved.id, arguments={}, state="running", progress=progress, created_at=START)
    stored.add_all([job, waiting])
    stored.commit()
    kept = f"/events/{moved.id}", f"/events/{refused.id}", f"/buildings/{of.code}/events", f"/jobs/{waiting.id}"
    pages = *kept, f"/buildings/{of.code}/recordings", f"/modes?building={of.code}"
    with client(database_url) as api:
        for page in pages:
            text = unescape(api.get(page, headers={"Accept-Language": "ja"}).text)
            shown = READ.sub(lambda found: f" {found[1] or ''} ", text.replace(of.name, "").replace(of.code, ""))
            left = [line for line in shown.splitlines() if set(ENGLISH.findall(line)) - NAMES]
            assert left == [], page
        assert "地震を解析中" in api.get(f"/jobs/{waiting.id}", headers={"Accept-Language": "ja"}).text
        streams = [api.get(f"/api/v1/jobs/{job.id}/progress", params=one).text for one in ({"language": "ja"}, {})]
    assert ["地震を解析中" in one for one in streams] == [True, False]
    assert ['"Analysing the event"' in one for one in streams] == [False, True]
    assert all('"done"' in one for one in streams), "the state is a word for programs"
