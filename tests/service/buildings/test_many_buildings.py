"""Lists of buildings come in pages, and what is read for a page or a scrape does not grow with the buildings."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from api_client import client
from monitored_building import building_file
from prometheus_client import generate_latest
from sqlalchemy import event as sqlalchemy_event, select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.pages import LISTED
from service.buildings.tables import Building, Revision
from service.db.sessions import reading
from service.health.metrics import registry
from service.records.tables import Event
from service.verdict import reading as verdicts

START = datetime(2024, 1, 1, tzinfo=UTC)


def add(session: Session, first: int, count: int) -> None:
    """So many buildings, each with an event that was analysed without a result."""
    for number in range(first, first + count):
        building = Building(code=f"B{number:03}", name=f"tower {number}", created_at=START)
        start = START + timedelta(days=number)
        session.add(Revision(building=building, number=1, toml=building_file(Path("/")), folder="/", created_at=START))
        session.add(
            Event(building=building, start=start, end=start, state="analysed", created_at=start, updated_at=start)
        )


@contextmanager
def counted(sessions: sessionmaker[Session]) -> Iterator[Callable[[], int]]:
    """Number of statements since then."""
    statements: list[str] = []

    def note(_1: object, _2: object, statement: str, *_3: object) -> None:
        statements.append(statement)

    sqlalchemy_event.listen(sessions.kw["bind"], "before_cursor_execute", note)
    yield lambda: len(statements)
    sqlalchemy_event.remove(sessions.kw["bind"], "before_cursor_execute", note)


def test_a_scrape_takes_as_many_statements_for_one_building_as_for_seven(sessions: sessionmaker[Session]) -> None:
    numbers = []
    for first, count in ((0, 1), (1, 6)):
        with sessions.begin() as session:
            add(session, first, count)
        with counted(sessions) as statements:
            text = generate_latest(registry(reading(sessions))).decode()
            numbers.append(statements())
        assert text.count("menshin_verdict{") == first + count
    assert numbers[0] == numbers[1]


def test_the_verdicts_of_several_buildings_are_those_of_each(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        add(session, 0, 3)
    with sessions() as session:
        together = verdicts.of_buildings(session, select(Building.id).where(Building.code != "B001"))
        each = {one.id: verdicts.of_building(session, one) for one in session.query(Building) if one.code != "B001"}
    assert together == each
    assert len(each) == 2


@pytest.mark.parametrize("path", ["buildings", "sources"])
def test_the_lists_of_the_api_come_in_pages(database_url: str, sessions: sessionmaker[Session], path: str) -> None:
    with sessions.begin() as session:
        add(session, 0, 3)
    with client(database_url) as asking:
        first = asking.get(f"/api/v1/{path}", params={"limit": 2}).json()
        second = asking.get(f"/api/v1/{path}", params={"limit": 2, "cursor": first["next"]}).json()
    codes = [one.get("code", one.get("building")) for one in (*first["items"], *second["items"])]
    assert codes == ["B000", "B001", "B002"]
    assert second["next"] is None


def test_the_first_page_lists_so_many_buildings_and_shows_the_one_shaken_last(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        add(session, 0, LISTED + 1)
    with client(database_url) as asking, counted(sessions):
        first, second = asking.get("/").text, asking.get(f"/?cursor=B{LISTED - 1:03}").text
    assert f'href="/?cursor=B{LISTED - 1:03}" rel="next"' in first
    assert f"<td>tower {LISTED}<" not in first
    assert f"<td>tower {LISTED}<" in second
    assert "Further ones" not in second
    assert f"tower {LISTED}: last event" in first
