"""The page of a building: the verdict first, whom to call, health of the sensors, and the years."""

import re
from html import unescape
from pathlib import Path

import pytest
from alert_candidates import softer_isolators
from alert_fixtures import SOON, with_stored_events
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, building_file, day, earthquake
from sqlalchemy import Engine, event as sqlalchemy_event
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.buildings.pages.timeline import timeline
from service.records.tables import Event, Waveform
from service.verdict import reading
from service.verdict.checks import Level
from service.verdict.earthquakes import past_events

pytestmark = pytest.mark.sqlite

HOSTILE = '<script>alert("x")</script>'
CONTACT = f"""
[[contact]]
name = '{HOSTILE}'
role = "engineer & owner"
phone = "+81 3 0000-0100"
"""


def test_the_page_says_first_what_is_to_be_done_and_whom_to_call(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        of = building(session)
        named = building_file(of.code).replace('"a tower"', f"'{HOSTILE}'") + CONTACT
        building_store.update_description(session, named, Path("/"), day(0))
        add_comparison(session, earthquake(session, of, day(1), STRONG))
        code = of.code
    with client(database_url) as asking:
        pages = [asking.get(path).text for path in ("/", f"/buildings/{code}")]
        contacts = asking.get(f"/api/v1/buildings/{code}").json()["contacts"]
    assert contacts == [
        {"name": HOSTILE, "role": "engineer & owner", "phone": "+81 3 0000-0100", "mail": None}
    ]  # fmt: skip
    for page in pages:
        assert "<script>alert" not in page
        assert f"Call {HOSTILE} (engineer & owner)" in unescape(page)
        assert '<a href="tel:+81300000100">+81 3 0000-0100</a>' in page
    first = unescape(re.sub(r"<[^>]+>", "", pages[1].split('aria-label="In short"')[1].split("</section>")[0]))
    assert "Inspect" in first
    assert "Have the building inspected before normal use." in first
    assert "the isolators moved 295 mm, 73.8 % of the design limit" in first
    assert "checks passed" in first


def test_a_silent_and_a_suspect_sensor_are_seen_in_the_section(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        of = building(session)
        event = earthquake(session, of, day(1))
        recorded = ("HNX", "HNY", "HYX")
        session.add_all(
            Waveform(
                event_id=event.id,
                channel=f"XX.{of.code}.01.{one}",
                start=day(1),
                rate=1.0,
                count=0,
                gain=1.0,
                samples=b"",
            )
            for one in recorded
        )
        analysis = reading.record_queries.event_with_analysis(session, event.id).Analysis
        spike = {"kind": "spike", "severity": "warning", "message": "4 spikes", "value": None}
        analysis.quality = [{**spike, "channel": f"XX.{of.code}.01.HNY"}]
        code = of.code
    with client(database_url) as asking:
        page = unescape(asking.get(f"/buildings/{code}").text)
    assert f"XX.{code}.01.HNX, acceleration x: working" in page
    assert f"XX.{code}.01.HNY, acceleration y: suspect. 4 spikes" in page
    assert f"XX.{code}.01.HYY, displacement y: silent. It has no record of the last earthquake." in page
    assert "3 levels" not in page
    assert "2 levels above the isolators; 4 sensors: 2 working, 1 suspect, 1 silent" in page


def test_a_refused_earthquake_is_a_data_problem(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        event = earthquake(session, of, day(1))
        event.state, event.reason = "refused", "the base slab's record is missing"
        reading.record_queries.event_with_analysis(session, event.id).Analysis.refusal = event.reason
        code = of.code
    with client(database_url) as asking:
        pages = [unescape(asking.get(path).text) for path in ("/", f"/buildings/{code}")]
    for page in pages:
        assert "the base slab's record is missing" in page
    assert f"{code}: Its records cannot be used" in pages[0]


def test_no_sensor_is_called_working_before_its_record_is_analysed(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        of = building(session)
        times = {"start": day(2), "end": day(2) + SOON, "created_at": day(2), "updated_at": day(2)}
        event = Event(building_id=of.id, state="gathering", **times)
        session.add(event)
        code = of.code
    with client(database_url) as asking:
        page = unescape(asking.get(f"/buildings/{code}").text)
        assert f"XX.{code}.01.HNX, acceleration x: no record yet. No record of the last earthquake has arrived" in page
    with sessions.begin() as session:
        piece = {"start": day(2), "rate": 1.0, "count": 0, "gain": 1.0, "samples": b""}
        session.add(Waveform(event_id=session.merge(event).id, channel=f"XX.{code}.01.HNX", **piece))
    with client(database_url) as asking:
        page = unescape(asking.get(f"/buildings/{code}").text)
    assert f"XX.{code}.01.HNX, acceleration x: not checked yet. Its record of the last earthquake is not" in page


def test_the_years_show_each_earthquake_as_its_own_page_does_and_no_normal_one_beside_an_open_loss(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        of = building(session)
        for number, displacement in ((1, 0.02), (2, STRONG), (3, 0.43)):
            add_comparison(session, earthquake(session, of, day(number), displacement))
        alone = [reading.of_event(session, one) for one in session.query(Event).order_by(Event.start)]
        assert [one.verdict for one in past_events(session, of, 10)] == alone
        events = tuple(earthquake(session, of, day(number)) for number in (10, 11, 12))
        for one in events:
            add_comparison(session, one)
        lost = [with_stored_events(softer_isolators(), tuple(one.id for one in events))]
        reconcile(session, of.id, lost, "events", day(12) + SOON)
        session.flush()
        operator_actions.inspect(session, session.query(Alert).one(), "Jo", "confirmed", "seen", None, day(20))
        add_comparison(session, earthquake(session, of, day(30)))
        levels = [one.verdict.level for one in past_events(session, of, 10)]
        assert levels[-4:] == [Level.WATCH, Level.WATCH, Level.WATCH, Level.NORMAL]
        code = of.code
    with client(database_url) as asking:
        page = unescape(asking.get(f"/buildings/{code}").text)
    assert "8 earthquakes in 2024: 1 act, 1 inspect, 1 undecided, 4 watch, 1 normal" in page
    assert "Jo: confirmed, alert 1" in page


def test_the_years_say_that_they_show_the_latest_earthquakes_where_there_are_more(
    sessions: sessionmaker[Session],
) -> None:
    with sessions.begin() as session:
        of = building(session)
        for number in range(1, 5):
            earthquake(session, of, day(number))
        session.flush()
        some, every = (timeline(session, of, day(10), most) for most in (3, 5))
        assert some is not None
        assert every is not None
        assert len(some.earthquakes) == 3
        assert some.summary.startswith("The latest 3 of 5 earthquakes, in 2024: ")
        assert every.summary.startswith("5 earthquakes in 2024: ")


def test_the_years_take_as_many_statements_for_twenty_earthquakes_as_for_two(sessions: sessionmaker[Session]) -> None:
    statements: list[str] = []

    def note(_1: object, _2: object, statement: str, *_3: object) -> None:
        statements.append(statement)

    numbers = []
    with sessions.begin() as session:
        of = building(session)
        for count in (1, 18):
            for _ in range(count):
                add_comparison(session, earthquake(session, of, day(session.query(Event).count())))
            session.flush()
            session.expire_all()
            statements.clear()
            sqlalchemy_event.listen(Engine, "before_cursor_execute", note)
            assert len(past_events(session, of, 300)) == session.query(Event).count()
            sqlalchemy_event.remove(Engine, "before_cursor_execute", note)
            numbers.append(len(statements))
    assert numbers[0] == numbers[1]
