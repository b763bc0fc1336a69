"""Stopped data is reported once, in time, and so is its return."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event as Signal, Thread
from time import monotonic, sleep

import monitored_building
import paper_records
import pytest
from alert_candidates import START, softer_isolators
from alert_fixtures import building, earthquake, reported, states
from monitoring_server import Page, building_file, monitoring_server
from sqlalchemy import update
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.periodic_checks import check_buildings
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.jobs import queue as job_queue
from service.jobs.tables import Job
from service.notify.tables import Message
from service.poller import Poller
from service.records.events import remember_channels
from service.records.source_poller import SourcePoller
from service.records.tables import Event, Recording, SourceState, Waveform
from service.settings import Settings

QUIET = {"disk_reserve": 0, "http_retries": 0, "settle_time": 0, "event_grace": 0}
SETTINGS = Settings(**QUIET)
HOUR, MINUTE = timedelta(hours=1), timedelta(minutes=1)
NOW = START + 100 * HOUR


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


def test_a_job_without_a_worker_is_reported(sessions: sessionmaker[Session]) -> None:
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


def test_a_worker_that_died_during_a_job_is_reported(sessions: sessionmaker[Session]) -> None:
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


def test_a_stopped_round_ends_between_two_buildings(sessions: sessionmaker[Session]) -> None:
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


def test_a_dead_channel_is_reported_and_its_return(sessions: sessionmaker[Session]) -> None:
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
    piece = Waveform(event_id=event.id, channel=channel, start=event.start, rate=100.0, count=1, gain=1.0, samples=b"")
    session.add(piece)
    remember_channels(session, event.building_id, [piece])


def test_a_record_from_the_future_reveals_a_wrong_clock(sessions: sessionmaker[Session], tmp_path: Path) -> None:
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


def test_an_alert_raised_during_a_silence_is_reported_at_its_end(sessions: sessionmaker[Session]) -> None:
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


def test_a_server_with_a_wrong_clock_is_reported_until_it_is_corrected(sessions: sessionmaker[Session]) -> None:
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


def test_the_poller_runs_the_periodic_checks(sessions: sessionmaker[Session], tmp_path: Path) -> None:
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
