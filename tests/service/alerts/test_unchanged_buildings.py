"""Periodic checks of unchanged buildings: few statements, and nothing due is missed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

import monitored_building
import pytest
from alert_candidates import START
from alert_fixtures import building, earthquake, raise_softening, reported, states
from sqlalchemy import event, select, update
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.checked_buildings import Checked
from service.alerts.periodic_checks import check_buildings
from service.alerts.tables import Alert, BuildingCheck
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building, Revision
from service.jobs import queue as job_queue
from service.jobs.tables import Job
from service.notify.tables import Delivery, Message
from service.records.tables import SourceState
from service.settings import Settings

QUIET = {"disk_reserve": 0, "http_retries": 0, "settle_time": 0, "event_grace": 0}
SETTINGS = Settings(**QUIET)
HOUR, MINUTE = timedelta(hours=1), timedelta(minutes=1)
IDLE_STATEMENTS = 12
"""Statements of a round in which nothing changed, however many buildings there are."""
NOW = START + 100 * HOUR


@pytest.fixture
def settled(sessions: sessionmaker[Session]) -> dict[int, Checked]:
    """States after some rounds at a building with an active alert, an open data alert and messages about both."""
    last: dict[int, Checked] = {}
    with sessions.begin() as session:
        made = building(session)
        raise_softening(session, made)
        job_queue.enqueue(session, earthquake(session, made, NOW - 3 * HOUR), {}, NOW - 2 * HOUR)
    for minutes in range(4):
        check_buildings(sessions, SETTINGS, NOW + minutes * MINUTE, last=last)
    assert states(sessions) == {"stiffness": "active", "worker": "active"}
    return last


@contextmanager
def executed(sessions: sessionmaker[Session]) -> Iterator[list[str]]:
    """The statements since then."""
    statements: list[str] = []

    def note(_1: object, _2: object, statement: str, *_3: object) -> None:
        statements.append(statement)

    event.listen(sessions.kw["bind"], "before_cursor_execute", note)
    yield statements
    event.remove(sessions.kw["bind"], "before_cursor_execute", note)


def test_an_unchanged_building_takes_few_statements_and_writes_nothing(
    sessions: sessionmaker[Session], settled: dict[int, Checked]
) -> None:
    with executed(sessions) as statements:
        check_buildings(sessions, SETTINGS, NOW + 5 * MINUTE, last=settled)
    assert 0 < len(statements) <= IDLE_STATEMENTS
    assert not [one for one in statements if not one.lstrip().startswith("SELECT") and one != "BEGIN"]
    assert not [one for one in statements if " UPDATE" in one]
    assert not [one for one in statements if "waveform" in one]


def test_a_round_without_news_takes_the_same_number_of_statements_for_any_number_of_buildings(
    sessions: sessionmaker[Session],
) -> None:
    """The others are like the first, which is settled; one of them gets news at the end."""
    last: dict[int, Checked] = {}
    text = monitored_building.building_file(Path("/nowhere"))
    with sessions.begin() as session:
        building_store.add(session, text, Path("/"), NOW)
    for minutes in range(4):
        check_buildings(sessions, SETTINGS, NOW + minutes * MINUTE, last=last)
    numbers, (settled,) = [], last.values()
    for count in (10, 100, 1000):
        with sessions.begin() as session:
            for number in range(len(last), count):
                made = Building(code=f"B{number}", name="tower", created_at=NOW)
                session.add(Revision(building=made, number=1, toml=text, folder="/", created_at=NOW))
            session.flush()
            last |= dict.fromkeys(session.scalars(select(Building.id)), settled)
        with executed(sessions) as statements:
            check_buildings(sessions, SETTINGS, NOW + 5 * MINUTE, last=last)
        numbers.append(len(statements))
    assert numbers == numbers[:1] * 3
    assert 0 < numbers[0] <= IDLE_STATEMENTS
    with sessions.begin() as session:
        changed = session.query(Building).filter_by(code="B500").one().id
        session.add(SourceState(building_id=changed, cursor={}, attempted_at=NOW, failing_since=NOW, error="503"))
    check_buildings(sessions, SETTINGS, NOW + 6 * MINUTE, last=last)
    with sessions() as session:
        assert [(one.building_id, one.cause) for one in session.query(Alert)] == [(changed, "source")]


def test_a_poller_that_starts_checks_only_what_changed_since_the_last_one(sessions: sessionmaker[Session]) -> None:
    """Among 30 buildings one is muted, and another has news, after the last round of the previous poller."""
    last: dict[int, Checked] = {}
    text = monitored_building.building_file(Path("/nowhere"))
    with sessions.begin() as session:
        for number in range(30):
            made = Building(code=f"B{number}", name="tower", created_at=NOW)
            session.add(Revision(building=made, number=1, toml=text, folder="/", created_at=NOW))
    for minutes in range(3):
        check_buildings(sessions, SETTINGS, NOW + minutes * MINUTE, last=last)
    assert all(one.is_quiet for one in last.values())
    with executed(sessions) as statements:
        check_buildings(sessions, SETTINGS, NOW + 5 * MINUTE, last={})
    assert 0 < len(statements) <= IDLE_STATEMENTS + 1
    assert not [one for one in statements if not one.lstrip().startswith("SELECT") and one != "BEGIN"]
    with sessions.begin() as session:
        failed = session.query(Building).filter_by(code="B5").one().id
        session.add(SourceState(building_id=failed, cursor={}, attempted_at=NOW, failing_since=NOW, error="503"))
        session.execute(update(Building).where(Building.code == "B7").values(name="mill"))
        changed = session.query(Building).filter_by(code="B7").one().id
        session.add(Revision(building_id=changed, number=2, toml=text, folder="/", created_at=NOW))
    anew: dict[int, Checked] = {}
    check_buildings(sessions, SETTINGS, NOW + 6 * MINUTE, last=anew)
    assert sorted(number for number, one in anew.items() if one.checked_at == NOW + 6 * MINUTE) == [failed, changed]
    with sessions() as session:
        assert [(one.building_id, one.cause) for one in session.query(Alert)] == [(failed, "source")]
        kept = set(session.scalars(select(BuildingCheck.building_id)))
    assert kept == last.keys() - {failed, changed}, "what was not quiet is checked again by the next one"


@pytest.mark.parametrize("change", ["time", "settings"])
def test_a_kept_check_ends_with_its_time_and_with_the_settings(sessions: sessionmaker[Session], change: str) -> None:
    last: dict[int, Checked] = {}
    with sessions.begin() as session:
        building_store.add(session, monitored_building.building_file(Path("/nowhere")), Path("/"), NOW)
    for minutes in range(3):
        check_buildings(sessions, SETTINGS, NOW + minutes * MINUTE, last=last)
    ((number, before),) = last.items()
    now = before.expires_at if change == "time" else NOW + 5 * MINUTE
    settings = SETTINGS if change == "time" else Settings(**QUIET, reminder_interval=60.0)
    anew: dict[int, Checked] = {}
    check_buildings(sessions, settings, now, last=anew)
    assert anew[number].checked_at == now


def test_an_unchanged_building_is_checked_in_full_every_half_day(
    sessions: sessionmaker[Session], settled: dict[int, Checked]
) -> None:
    """A loss that no version shows is repaired within half a day: here of all messages."""
    with sessions.begin() as session:
        session.query(Message).delete()
    check_buildings(sessions, SETTINGS, NOW + 5 * MINUTE, last=settled)
    assert reported(sessions) == []
    check_buildings(sessions, SETTINGS, NOW + 12 * HOUR, last=settled)
    assert reported(sessions)


def test_an_unchanged_building_is_checked_in_full_after_the_clock_was_set_back(
    sessions: sessionmaker[Session], settled: dict[int, Checked]
) -> None:
    """Its next full check would be as far ahead as the clock was."""
    with sessions.begin() as session:
        session.query(Message).delete()
    check_buildings(sessions, SETTINGS, NOW - 5 * MINUTE, last=settled)
    assert reported(sessions)


def test_jobs_are_read_once_a_round_for_any_number_of_buildings(sessions: sessionmaker[Session]) -> None:
    numbers = []
    for _ in range(3):
        with sessions.begin() as session:
            made = building(session)
            job_queue.enqueue(session, earthquake(session, made, NOW - 3 * HOUR), {}, NOW - 2 * HOUR)
        with executed(sessions) as statements:
            check_buildings(sessions, SETTINGS, NOW)
        numbers.append(len([one for one in statements if "job.claimed_until" in one or "max(job.finished_at)" in one]))
    assert numbers == numbers[:1] * 3
    assert states(sessions) == {"worker": "active"}
    with sessions() as session:
        assert session.query(Alert).count() == 3


def refused_event(session: Session, of: Building) -> None:
    made = earthquake(session, of, NOW - HOUR)
    made.state, made.reason = "refused", "every sensor is dead"


def new_recipient(session: Session, of: Building) -> None:
    rule = ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES)
    recipients.follow_file(session, of.id, [rule], NOW)


def inspected(session: Session, of: Building) -> None:
    alert = session.query(Alert).filter(Alert.cause == "stiffness").one()
    operator_actions.inspect(session, alert, "Jo", "confirmed", "bearings replaced", None, NOW)


@pytest.mark.parametrize("change", [refused_event, new_recipient, inspected])
def test_a_round_with_memory_writes_the_same_as_one_without(
    sessions: sessionmaker[Session], settled: dict[int, Checked], change: Callable[[Session, Building], None]
) -> None:
    with sessions.begin() as session:
        change(session, session.query(Building).one())

    def sent() -> tuple[int, int]:
        with sessions() as session:
            return session.query(Message).count(), session.query(Delivery).count()

    before = sent()
    check_buildings(sessions, SETTINGS, NOW + 6 * MINUTE, last=settled)
    after = sent()
    assert after != before
    check_buildings(sessions, SETTINGS, NOW + 6 * MINUTE)
    assert sent() == after


def test_an_unchanged_building_gets_its_reminder_when_due(sessions: sessionmaker[Session]) -> None:
    settings, last = Settings(**QUIET | {"reminder_interval": 3600.0}), dict[int, Checked]()
    with sessions.begin() as session:
        made = building(session)
        new_recipient(session, made)
        raise_softening(session, made)
    for minutes in range(4):
        check_buildings(sessions, settings, NOW + minutes * MINUTE, last=last)
    assert all(one.is_settled for one in last.values())
    check_buildings(sessions, settings, NOW + HOUR - MINUTE, last=last)
    assert "repeat" not in [order for _, order, _ in reported(sessions)]
    check_buildings(sessions, settings, NOW + HOUR, last=last)
    assert [order for _, order, _ in reported(sessions)].count("repeat") == 1


def test_messages_that_wait_for_a_comparison_are_sent_when_it_fails(sessions: sessionmaker[Session]) -> None:
    last: dict[int, Checked] = {}
    with sessions.begin() as session:
        made = building(session)
        earthquake(session, made, NOW - HOUR)
        job_queue.enqueue_monitoring(session, made.id, None, NOW - MINUTE)
    for minutes in range(4):
        check_buildings(sessions, SETTINGS, NOW + minutes * MINUTE, last=last)
    assert reported(sessions) == []
    with sessions.begin() as session:
        session.execute(update(Job).where(Job.kind == job_queue.WATCH).values(state="failed"))
    check_buildings(sessions, SETTINGS, NOW + 4 * MINUTE, last=last)
    assert [kind for kind, _, _ in reported(sessions)] == ["event"]


def test_the_end_of_a_silence_is_noticed(sessions: sessionmaker[Session]) -> None:
    last: dict[int, Checked] = {}
    with sessions.begin() as session:
        made = building(session)
        raise_softening(session, made)
        operator_actions.silence(session, made, "*", NOW + HOUR, "a load test", "Jo", NOW - HOUR)
    for minutes in range(4):
        check_buildings(sessions, SETTINGS, NOW + minutes * MINUTE, last=last)
    assert not [one for one in reported(sessions) if one[2] == "alarm"]
    check_buildings(sessions, SETTINGS, NOW + 2 * HOUR, last=last)
    assert [one for one in reported(sessions) if one[2] == "alarm"]
