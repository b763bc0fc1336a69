"""Stopped data is reported once, in time, and so is its return."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event as Signal, Thread
from time import monotonic, sleep

import monitored_building
import paper_records
import pytest
from alert_candidates import START, softer_isolators
from alert_fixtures import building, earthquake, raise_softening
from monitoring_server import Page, building_file, monitoring_server
from sqlalchemy import event, select, update
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.periodic_checks import Checked, check_buildings
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building, Revision
from service.jobs import queue as job_queue
from service.jobs.tables import Job
from service.notify.tables import Delivery, Message
from service.poller import Poller
from service.records.source_poller import SourcePoller
from service.records.tables import Event, Recording, SourceState, Waveform
from service.settings import Settings

QUIET = {"disk_reserve": 0, "http_retries": 0, "settle_time": 0, "event_grace": 0}
SETTINGS = Settings(**QUIET)
HOUR, MINUTE = timedelta(hours=1), timedelta(minutes=1)
IDLE_STATEMENTS = 12
"""Statements of a round in which nothing changed, however many buildings there are."""
NOW = START + 100 * HOUR


def states(sessions: sessionmaker[Session]) -> dict[str, str]:
    with sessions() as session:
        return {alert.cause: alert.state for alert in session.query(Alert)}


def reported(sessions: sessionmaker[Session]) -> list[tuple[str, str, str]]:
    with sessions() as session:
        return [(one.kind, one.sequence, one.severity) for one in session.query(Message).order_by(Message.id)]


def test_a_source_that_stops_is_reported_once_and_resolves_by_itself(
    sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    """A folder that is not mounted, then is again."""
    folder, now = tmp_path / "records", NOW
    with sessions.begin() as session:
        building_store.add(session, monitored_building.building_file(folder), tmp_path, NOW)
    poller = SourcePoller(sessions, SETTINGS, lambda: now)
    poller.poll("PAPER")
    for now in (NOW + HOUR, NOW + 1.1 * HOUR, NOW + 2 * HOUR):
        check_buildings(sessions, SETTINGS, now)
    assert states(sessions) == {"source": "active"}
    folder.mkdir()
    poller.poll("PAPER")
    for now in (NOW + 3 * HOUR, NOW + 4 * HOUR):
        check_buildings(sessions, SETTINGS, now)
    assert states(sessions) == {"source": "resolved"}
    assert reported(sessions) == [("data", "new", "warning"), ("data", "updated", "note")]
    with sessions() as session:
        first, second = (one.sentences[0] for one in session.query(Message).order_by(Message.id))
        assert first.startswith("The monitoring server has never answered at its address, since 5 January 2024")
        assert second.startswith("This has ended: The monitoring server has never answered at its address")


def test_work_that_no_one_does_is_reported(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        event = earthquake(session, building(session), NOW - HOUR)
        job_queue.enqueue(session, event, {}, NOW)
    check_buildings(sessions, SETTINGS, NOW + HOUR / 3)
    assert states(sessions) == {}
    check_buildings(sessions, SETTINGS, NOW + HOUR)
    assert states(sessions) == {"worker": "active"}
    with sessions.begin() as session:
        session.execute(update(Job).where(Job.state == "waiting").values(state="done", finished_at=NOW + HOUR))
    check_buildings(sessions, SETTINGS, NOW + HOUR)
    assert states(sessions) == {"worker": "resolved"}


def test_a_worker_that_died_over_a_job_is_reported(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        event = earthquake(session, building(session), NOW - HOUR)
        job_queue.enqueue(session, event, {}, NOW)
    with sessions.begin() as session:
        assert job_queue.claim(session, NOW, HOUR)
    check_buildings(sessions, SETTINGS, NOW + HOUR)
    assert states(sessions) == {}
    check_buildings(sessions, SETTINGS, NOW + 2 * HOUR)
    assert states(sessions) == {"worker": "active"}


def test_a_full_disk_is_reported(sessions: sessionmaker[Session], database_url: str) -> None:
    with sessions.begin() as session:
        building(session)
    greedy = Settings(disk_reserve=2**62)
    check_buildings(sessions, greedy, NOW)
    check_buildings(sessions, greedy, NOW + HOUR)
    assert states(sessions) == ({"disk": "active"} if database_url.startswith("sqlite") else {})
    with sessions() as session:
        for alert in session.query(Alert):
            assert alert.began_at == NOW


def test_a_round_that_is_stopped_ends_between_two_buildings(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        for number in range(3):
            event = earthquake(session, building(session), NOW - HOUR + number * HOUR / 60)
            job_queue.enqueue(session, event, {}, NOW - HOUR)
    answers = iter([False, True])
    check_buildings(sessions, SETTINGS, NOW + HOUR, lambda: next(answers))
    with sessions() as session:
        assert session.query(Alert).count() == 1
    check_buildings(sessions, SETTINGS, NOW + HOUR)
    with sessions() as session:
        assert session.query(Alert).count() == 3


def test_a_dead_channel_is_reported_and_comes_back(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        for number in range(4):
            event = earthquake(session, of, START + number * HOUR)
            for channel in list(paper_records.SENSORS)[: 5 if number == 0 else 4]:
                _seen(session, event, channel)
    check_buildings(sessions, SETTINGS, NOW)
    assert states(sessions) == {f"channel/{list(paper_records.SENSORS)[4]}": "active"}
    with sessions.begin() as session:
        event = earthquake(session, session.query(Building).one(), START + 5 * HOUR)
        for channel in paper_records.SENSORS:
            _seen(session, event, channel)
    check_buildings(sessions, SETTINGS, NOW)
    assert set(states(sessions).values()) == {"resolved"}


def _seen(session: Session, event: Event, channel: str) -> None:
    session.add(
        Waveform(event_id=event.id, channel=channel, start=event.start, rate=100.0, count=1, gain=1.0, samples=b"")
    )


def test_a_record_from_the_future_shows_the_clock(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    with sessions.begin() as session:
        of = building_store.add(session, monitored_building.building_file(tmp_path), tmp_path, NOW)
        session.flush()
        session.add(SourceState(building_id=of.id, cursor={}, attempted_at=NOW, succeeded_at=NOW))
        session.add(
            Recording(
                building_id=of.id,
                name="a",
                origin="a",
                received_at=NOW,
                kind="waveforms",
                state="read",
                start=NOW,
                end=NOW + HOUR,
            )
        )
    check_buildings(sessions, SETTINGS, NOW)
    assert states(sessions) == {"clock/recorder": "active"}


def test_a_round_shows_what_was_silenced_and_what_no_one_reported(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        event = earthquake(session, of, START)
        found = softer_isolators(onset_event_id=event.id, raised_event_id=event.id, event_ids=(event.id,))
        reconcile(session, of.id, [found], "events", NOW)
        operator_actions.silence(session, of, "*", NOW + HOUR, "a test", "Jo", NOW)
    check_buildings(sessions, SETTINGS, NOW)
    assert reported(sessions) == []
    check_buildings(sessions, SETTINGS, NOW + HOUR)
    assert reported(sessions) == [("alert", "new", "alarm")]


def test_a_server_whose_clock_differs_is_reported_until_it_is_set(sessions: sessionmaker[Session]) -> None:
    """Ours is ten minutes fast, then right."""
    now = datetime.now(UTC)
    with monitoring_server() as server:
        server.pages["/events/"] = Page(b"")
        with sessions.begin() as session:
            text = building_file("archive", f"{server.address}/events/")
            building_store.add(session, text, Path("/"), now)
        for ours, wanted in ((now + timedelta(minutes=10), "active"), (now, "resolved")):
            look_at(sessions, ours)
            check_buildings(sessions, SETTINGS, ours)
            assert states(sessions) == {"clock/server": wanted}
    with sessions() as session:
        assert session.query(Alert).one().evidence["ahead"] == pytest.approx(-600, abs=60)  # one machine, 1 s of Date


def look_at(sessions: sessionmaker[Session], now: datetime) -> None:
    SourcePoller(sessions, SETTINGS, lambda: now).poll("TOWER")


def test_the_poller_makes_the_rounds(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    """Its first round comes at once; patience with the folder that is not there ends at once."""
    stop = Signal()
    settings = Settings(**QUIET | {"source_patience": 1e-3, "check_interval": 0.1, "poll_interval": 0.1})
    with sessions.begin() as session:
        building_store.add(session, monitored_building.building_file(tmp_path / "nowhere"), tmp_path, datetime.now(UTC))
    polling = Thread(target=Poller(sessions, settings).run, args=(stop,))
    polling.start()
    try:
        end = monotonic() + 20
        while states(sessions) != {"source": "active"}:
            assert monotonic() < end, states(sessions)
            sleep(0.05)
    finally:
        stop.set()
        polling.join(20)
    assert reported(sessions) == [("data", "new", "warning")]


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
    assert not [one for one in statements if "FOR UPDATE" in one]
    assert not [one for one in statements if "waveform" in one]


def test_a_round_without_news_takes_as_many_statements_for_a_thousand_buildings_as_for_ten(
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


def test_an_unchanged_building_is_checked_in_full_now_and_then(
    sessions: sessionmaker[Session], settled: dict[int, Checked]
) -> None:
    """A loss that no version shows is repaired within half a day: here of all messages."""
    with sessions.begin() as session:
        session.query(Message).delete()
    check_buildings(sessions, SETTINGS, NOW + 5 * MINUTE, last=settled)
    assert reported(sessions) == []
    check_buildings(sessions, SETTINGS, NOW + 12 * HOUR, last=settled)
    assert reported(sessions)


def test_a_clock_that_was_set_back_ends_the_rest_of_an_unchanged_building(
    sessions: sessionmaker[Session], settled: dict[int, Checked]
) -> None:
    """Its next full check would be as far ahead as the clock was."""
    with sessions.begin() as session:
        session.query(Message).delete()
    check_buildings(sessions, SETTINGS, NOW - 5 * MINUTE, last=settled)
    assert reported(sessions)


def test_the_jobs_are_read_once_a_round_however_many_buildings_there_are(sessions: sessionmaker[Session]) -> None:
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
def test_a_round_that_remembers_writes_what_one_that_does_not_would(
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


def test_a_reminder_that_becomes_due_ends_the_rest_of_an_unchanged_building(sessions: sessionmaker[Session]) -> None:
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


def test_messages_that_wait_for_a_comparison_go_when_it_has_failed(sessions: sessionmaker[Session]) -> None:
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
