"""Lists of buildings come in pages, and what is read for a page or a scrape does not grow with what it shows."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from alert_candidates import gain_error
from alert_fixtures import AGE
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, day, earthquake
from monitored_building import building_file
from sqlalchemy import Engine, event as sqlalchemy_event, insert, select
from sqlalchemy.orm import Session, sessionmaker

from core.comparison.misfit import Misfit
from service.alerts import inspections, operator_actions, periodic_checks
from service.alerts.checked_buildings import Checked
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.buildings.pages.home import LISTED
from service.buildings.pages.map import drawn, read_area
from service.buildings.pages.summary import summaries
from service.buildings.tables import Building, Revision
from service.db.sessions import reading
from service.health.metrics import GAUGES, exposition
from service.models.tables import ModelComparison, ModelVersion
from service.records.tables import Content, Event, Waveform
from service.settings import Settings
from service.verdict import levels, reading as verdicts
from service.verdict.assessment import Result
from service.verdict.checks import Level
from service.verdict.levels import Area, Selection
from service.verdict.tables import BuildingLevel

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


@contextmanager
def counting() -> Iterator[Callable[[], int]]:
    """Number of statements of every engine since then, without those that a caller's rights take once a second."""
    statements: list[str] = []

    def note(_1: object, _2: object, statement: str, *_3: object) -> None:
        if not re.match("BEGIN|.*(api_key|login|building_link)", statement, re.DOTALL):
            statements.append(statement)

    sqlalchemy_event.listen(Engine, "before_cursor_execute", note)
    yield lambda: len(statements)
    sqlalchemy_event.remove(Engine, "before_cursor_execute", note)


def test_a_scrape_takes_as_many_statements_for_one_building_as_for_seven(sessions: sessionmaker[Session]) -> None:
    numbers = []
    for first, count in ((0, 1), (1, 6)):
        with sessions.begin() as session:
            add(session, first, count)
        with counted(sessions) as statements:
            text = exposition(reading(sessions)).decode()
            numbers.append(statements())
        assert text.count("menshin_verdict{") == first + count
    assert numbers[0] == numbers[1]


def test_a_scrape_assesses_no_building_whose_level_is_stored(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        add(session, 0, 3)
    numbers, texts = [], []
    for _ in range(2):
        with counted(sessions) as statements, reading(sessions)() as session:
            texts.append(GAUGES["menshin_verdict"][2](session))
            numbers.append(statements())
        periodic_checks.check_buildings(sessions, Settings(), START + timedelta(days=1))
    assert texts[0] == texts[1] == dict.fromkeys(("B000", "B001", "B002"), Level.UNDECIDED.rank)
    assert numbers[0] > numbers[1] <= 2, "SQLite's BEGIN, and the levels; nothing of three buildings"


def test_the_verdicts_of_several_buildings_are_those_of_each(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        add(session, 0, 3)
    with sessions() as session:
        each = {one.id: verdicts.of_building(session, one) for one in session.query(Building) if one.code != "B001"}
        together = verdicts.of_buildings(session, list(each))
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


@pytest.mark.parametrize("path", ["buildings", "sources"])
def test_the_lists_of_the_api_take_as_many_statements_for_forty_buildings_as_for_three(
    database_url: str, sessions: sessionmaker[Session], path: str
) -> None:
    numbers, listed = [], []
    with client(database_url) as asking:
        for first, count in ((0, 3), (3, 37)):
            with sessions.begin() as session:
                add(session, first, count)
            with counting() as statements:
                listed.append(len(asking.get(f"/api/v1/{path}", params={"limit": 100}).json()["items"]))
                numbers.append(statements())
    assert listed == [3, 40]
    assert numbers[0] == numbers[1] > 0


def add_years(session: Session, of: Building, model: ModelVersion, first: int, count: int) -> list[int]:
    """Numbers of so many more earthquakes, each with waveforms, original files that were deleted, a comparison with a
    model, a message, an alert with a comment, and an inspection."""
    numbers = []
    for number in range(first, first + count):
        at = day(number)
        event = earthquake(session, of, at, STRONG)
        add_comparison(session, event, -0.1)
        analysis = session.scalars(select(Analysis).where(Analysis.event_id == event.id)).one()
        analysis.inputs = [f"{number}/{file}" for file in range(count)]
        deleted = {"deleted_at": at, "deleted_by": "retention.original_files"}
        session.add_all(Content(sha256=one, size=1, data=b"", **deleted) for one in analysis.inputs)
        as_recorded = {"start": at, "rate": 100.0, "count": 1, "gain": 1.0, "samples": b""}
        session.add_all(Waveform(event_id=event.id, channel=f"XX.{one}", **as_recorded) for one in range(count))
        misfit = asdict(Misfit(samples=100, error=1e12, signal=1e12, spread=1e12, noise=1.0))
        compared = {"event_id": event.id, "analysis_id": analysis.id, "direction": "x", "role": "later"}
        session.add(ModelComparison(model=model, misfit=misfit, force=b"", created_at=at, version="test", **compared))
        numbers.append(event.id)
    every = session.scalars(select(Event.id).where(Event.building_id == of.id).order_by(Event.start)).all()
    found = [
        gain_error(f"XX.{one}", onset_event_id=one, raised_event_id=one, event_ids=(one, every[1])) for one in every
    ]
    reconcile(session, of.id, found, "events", day(first + count))
    session.flush()
    for alert in session.query(Alert):
        operator_actions.comment(session, alert, "Jo", f"seen of {count}", None, day(first + count))
    for number in range(first, first + count):
        inspections.record(session, of, "Jo", Result.RESTRICTED, f"no. {number}", day(number), AGE, day(first + count))
    write_messages(session, of.id, AGE, day(first + count))
    return numbers


@pytest.mark.parametrize("kind", ["building", "event"])
def test_a_page_takes_as_many_statements_for_twenty_earthquakes_as_for_three(
    database_url: str, sessions: sessionmaker[Session], kind: str
) -> None:
    numbers, shown = [], []
    with sessions.begin() as session:
        of = building(session)
        code = of.code
        made = {"created_at": START, "version": "test", "revision_id": building_store.current(session, of).id}
        empty = {"effects": {}, "standard_deviations": {}, "assumed": [], "change": "", "author": "Jo"}
        session.add(ModelVersion(building_id=of.id, direction="x", number=1, state="current", **made, **empty))
    with client(database_url) as asking:
        for first, count in ((1, 3), (4, 17)):
            with sessions.begin() as session:
                of, model = session.scalars(select(Building)).one(), session.scalars(select(ModelVersion)).one()
                events = add_years(session, of, model, first, count)
            path = f"/buildings/{code}" if kind == "building" else f"/events/{events[1]}"
            asking.get(path)  # opens the connections
            with counting() as statements:
                answer = asking.get(path)
                numbers.append(statements())
            shown.append(answer.text.count("reads 8 % more than its neighbours"))
    assert 0 < 3 * shown[0] < shown[1], "every open alert is listed"
    assert numbers[0] == numbers[1] > 0


def test_the_first_page_takes_as_many_statements_for_three_hundred_buildings_as_for_three(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    numbers, pages = [], []
    with client(database_url) as asking:
        asking.get("/")  # opens the connections
        for first, count in ((0, 3), (3, 297)):
            with sessions.begin() as session:
                add(session, first, count)
            with counting() as statements:
                pages.append(asking.get("/"))
                numbers.append(statements())
        second = asking.get("/?number=2").text
        found = asking.get("/?find=TOWER 29").text
    assert numbers[0] == numbers[1]
    assert len(pages[1].content) < 100_000
    assert "300 buildings" in pages[1].text
    assert f'<a href="/buildings/B{LISTED - 1:03}"' in pages[1].text
    assert f'<a href="/buildings/B{LISTED:03}"' not in pages[1].text
    assert f'<a href="/buildings/B{LISTED:03}"' in second
    assert "Page 2 of 6" in second
    assert "11 of 300 shown" in found
    assert '<a href="/buildings/B290"' in found


def test_the_first_page_is_in_order_of_the_levels_and_counts_them(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        normal, strong, silent, late = (building(session) for _ in range(4))
        for of, displacement in ((normal, 0.02), (strong, STRONG), (late, 0.02)):
            add_comparison(session, earthquake(session, of, day(1), displacement))
        session.add(
            Event(building=silent, start=day(2), end=day(2), state="refused", created_at=day(2), updated_at=day(2))
        )
        levels.store(session, [normal.id, strong.id, silent.id, late.id], day(3))
        add_comparison(session, earthquake(session, late, day(4), 1.0))  # after its level was stored
        codes = [late.code, strong.code, silent.code, normal.code]
    with client(database_url) as asking:
        page = asking.get("/").text
        inspected = asking.get("/?level=inspect").text
    assert re.findall(r'<tr class="(\w+)"><th scope="row"><a href="/buildings/(\w+)">', page) == [
        *zip(("act", "inspect", "no_data", "normal"), codes, strict=True)
    ]
    assert re.findall(r"<b>(\d+)</b> ([a-z ]+)</a>", page) == [
        ("1", "act"), ("1", "inspect"), ("1", "no data"), ("1", "normal")
    ]  # fmt: skip
    assert "295 mm, 73.8 % of the design limit" in page
    assert strong.code in inspected
    assert normal.code not in inspected


def test_buildings_that_were_never_assessed_count_beside_those_that_are_undecided(
    sessions: sessionmaker[Session],
) -> None:
    with sessions.begin() as session:
        add(session, 0, 5)
        first, second, *_ = (one.id for one in session.query(Building))
        levels.store(session, [first, second], START)
        found = levels.tally(session, Selection(text="b00"), [first])
    assert found.every == found.found == {Level.UNDECIDED: 4}


def test_the_periodic_checks_store_the_level_and_the_place_of_a_changed_building(
    sessions: sessionmaker[Session],
) -> None:
    with sessions.begin() as session:
        number = building(session).id
    last: dict[int, Checked] = {}
    for displacement, level in ((0.02, "normal"), (STRONG, "inspect")):
        with sessions.begin() as session:
            of = session.get_one(Building, number)
            add_comparison(session, earthquake(session, of, day(int(100 * displacement)), displacement))
        periodic_checks.check_buildings(sessions, Settings(), day(40), last=last)
        with sessions() as session:
            assert session.get_one(BuildingLevel, number).level == level


def placed(session: Session, spots: Sequence[tuple[float, float]], watched: str = "") -> None:
    """Buildings of normal level at these latitudes and longitudes, of which one is watched."""
    rows = [
        {"id": number, "code": f"B{number}", "name": f"tower {number} of the city", "created_at": START}
        for number in range(1, len(spots) + 1)
    ]
    session.execute(insert(Building), rows)
    levels_of = [
        {
            "building_id": row["id"],
            "level": (level := Level.WATCH if row["code"] == watched else Level.NORMAL).value,
            "rank": level.rank,
            "latitude": latitude,
            "longitude": longitude,
            "assessed_at": START,
        }
        for row, (latitude, longitude) in zip(rows, spots, strict=True)
    ]
    session.execute(insert(BuildingLevel), levels_of)


def test_ten_thousand_places_are_a_few_hundred_symbols_and_a_click_leads_nearer(
    sessions: sessionmaker[Session],
) -> None:
    rng = np.random.default_rng(7)
    spots = [(35 + a, (179.5 + b + 180) % 360 - 180) for a, b in rng.random((10_000, 2)).tolist()]
    with sessions.begin() as session:
        placed(session, spots, "B5")
    with counted(sessions) as statements, reading(sessions)() as session:
        shown = drawn(session, Selection(), levels.tally(session, Selection(), ()).extent, ())
        taken = statements()
        assert shown is not None
        watched = next(one for one in shown.places if one.level is Level.WATCH)
        there = Selection(area=read_area(watched.area))
        near, beside = levels.ranked(session, there, 0, 10_000), levels.tally(session, there, ())
        nearer = drawn(session, there, beside.extent, ())
    assert taken <= 3, "a beginning, the extent and the cells"
    assert len(shown.places) < 320
    assert sum(one.count for one in shown.places) == 10_000
    assert [(one.code, one.name) for one in shown.places if one.level is Level.WATCH] == [("B5", "tower 5 of the city")]
    assert watched.count <= len(near) < 10_000 / 50
    assert beside.found.total() == len(near) < beside.every.total() == 10_000
    assert nearer is not None
    assert len(nearer.places) > 20
    assert all(line.name.endswith("° N") for line in shown.parallels)
    assert {line.name[-1] for line in shown.meridians} <= {"E", "W", "°"}


def test_a_map_shows_what_the_page_lists_as_it_is_now_and_beside_the_others_of_its_place(
    sessions: sessionmaker[Session],
) -> None:
    with sessions.begin() as session:
        placed(session, [(35.0, 139.0), (35.0, 139.1), (48.0, 150.0)])
        strong = session.get_one(Building, 3)
        session.add(Revision(building=strong, number=1, toml=building_file(Path("/")), folder="/", created_at=START))
        earthquake(session, strong, day(4), STRONG)  # after its level was stored
    with reading(sessions)() as session:
        (line,) = summaries(session, [strong.id])
        others = levels.tally(session, Selection(), [strong.id])
        shown = drawn(session, Selection(), others.extent, [replace(line, latitude=35.001, longitude=139.0)])
    assert shown is not None
    east, west = sorted(shown.places, key=lambda one: -one.x)
    assert (east.count, east.code, east.level) == (1, "B2", Level.NORMAL)
    assert (west.count, west.code, west.level) == (2, "B3", Level.UNDECIDED)
    assert read_area(west.area) == Area(34.9995, 138.9995, 35.0015, 139.0005)
