"""Monitoring of a building: its series, its times, and its messages."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta

import pytest
import stored_histories
from building_models import BASE, LAYER
from sqlalchemy import delete, event as sqlalchemy_event, select, update
from sqlalchemy.orm import Session, sessionmaker

from core.drift.from_analyses import drift_series
from core.record import Finding
from service.alerts import operator_actions
from service.alerts.tables import Alert
from service.buildings import reference_periods
from service.buildings.tables import Building
from service.drift.series import monitored_series
from service.drift.tables import DriftState, DriftValue, MonitoredSeries, ReferencePeriod
from service.jobs import queue as job_queue
from service.jobs.queue import WATCH
from service.jobs.tables import Job
from service.notify.tables import Message
from service.records.tables import Event

NOW = stored_histories.start(40)


@pytest.fixture
def building(sessions: sessionmaker[Session]) -> int:
    with sessions.begin() as session:
        return stored_histories.building(session).id


def watching(sessions: sessionmaker[Session]) -> list[str]:
    with sessions() as session:
        return list(session.scalars(select(Job.state).where(Job.kind == WATCH).order_by(Job.id)))


def test_what_was_found_is_watched_by_event_in_order_of_time(sessions: sessionmaker[Session], building: int) -> None:
    found = [stored_histories.earthquake(number) for number in (2, 0, 1)]
    stored_histories.store_and_monitor(sessions, building, found, NOW)
    with sessions() as session:
        series = {(one.quantity, one.subject): one for one in monitored_series(session, building)}
        moments = {event.id: event.start for event in session.scalars(select(Event))}
    stiffness = series["stiffness", "x"].measurements
    assert len(stiffness) == 3 * stored_histories.CYCLES
    assert [one.time for one in stiffness] == sorted(one.time for one in stiffness)
    first, segment = stiffness[0], found[1].directions["x"].equivalent[0]
    assert (first.value, first.std, first.amplitude) == (segment.k_eq, segment.k_eq_std, segment.amplitude)
    assert first.time == stored_histories.start(0) + timedelta(seconds=(segment.start + segment.end) / 2)
    assert first.temperature == found[1].temperature
    assert series["damping", "x"].measurements[0].value == segment.c_eq
    assert series["gain", BASE].measurements[0].value == found[1].sensors[1].gain
    assert series["noise", BASE].measurements[0].value == found[1].sensors[1].noise
    mode = series["frequency", "x/1"].measurements[0]
    assert (mode.value, moments[mode.event]) == (
        found[1].directions["x"].restoring_force.modes[0].frequency,
        stored_histories.start(0),
    )
    residual = found[1].directions["x"].motion.residual
    assert series["residual_displacement", "x"].measurements[0].value == residual.value


def test_stored_analyses_give_the_series_that_a_notebook_gets(sessions: sessionmaker[Session], building: int) -> None:
    analyses = stored_histories.store_history(6)
    stored_histories.store_and_monitor(sessions, building, analyses, NOW)
    with sessions() as session:
        stored = monitored_series(session, building)
        numbers = session.scalars(select(Event.id).order_by(Event.start)).all()
    made = drift_series(analyses)
    assert [(one.quantity, one.subject) for one in stored] == list(made)
    for one in stored:
        own = made[one.quantity, one.subject].measurements
        assert tuple(one.measurements) == tuple(replace(measured, event=numbers[measured.event]) for measured in own)


def test_a_look_that_waits_does_for_all_that_comes_meanwhile(sessions: sessionmaker[Session], building: int) -> None:
    for number in range(3):
        with sessions.begin() as session:
            stored_histories.queue_analysis(session, building, stored_histories.start(number), NOW)
    for number in range(3):
        with sessions.begin() as session:
            stored_histories.store(
                session, stored_histories.claim_next(session, NOW), stored_histories.earthquake(number), NOW
            )
    assert watching(sessions) == ["waiting"]
    with sessions.begin() as session:
        held = stored_histories.claim_next(session, NOW)
        assert (
            job_queue.enqueue_monitoring(session, building, None, NOW).id > held.job_id
        )  # one that runs has seen less


def test_a_reference_period_requests_a_new_look(sessions: sessionmaker[Session], building: int) -> None:
    with sessions.begin() as session:
        of = session.get_one(Building, building)
        reference_periods.begin(session, of, None, None, None, None, "as built", "Kimura", NOW)
        reference_periods.begin(session, of, "gain", None, NOW, None, "sensors replaced", "Kimura", NOW)
        reference_periods.begin(session, of, "gain", BASE, NOW, None, "one more replaced", "Kimura", NOW)
    assert watching(sessions) == ["waiting"]
    with sessions() as session:
        periods = session.scalars(select(ReferencePeriod).order_by(ReferencePeriod.id)).all()
        requested = (("gain", BASE), ("gain", LAYER), ("noise", BASE))
        in_force = [reference_periods.in_force(periods, *one) for one in requested]
    assert [one.reason for one in in_force if one] == ["one more replaced", "sensors replaced", "as built"]
    assert reference_periods.in_force((), "gain", BASE) is None


def test_a_loss_is_reported_once_and_an_inspection_begins_a_new_reference(
    sessions: sessionmaker[Session], building: int
) -> None:
    found = stored_histories.store_history(26, onset=21)
    stored_histories.store_and_monitor(sessions, building, found, NOW)
    stored_histories.store_and_monitor(sessions, building, found[-1:], NOW)
    with sessions.begin() as session:
        (alert,) = session.scalars(select(Alert).where(Alert.cause == "stiffness"))
        reported = session.scalars(select(Message).where(Message.key == f"event/{alert.raised_event_id}")).all()
        assert (alert.state, alert.kind, len(reported)) == ("active", "deterioration", 1)
        assert alert.evidence["low"] < -0.08 < alert.evidence["high"] < 0
        assert {one["cause"] for one in alert.evidence["explanations"]} == {"mass", "gain/x"}
        assert any(one.startswith("Compared with all monitored quantities: a ") for one in alert.sentences)
        assert set(alert.channels) == {one for one in alert.channels if one.startswith("XX.PAPER.")} != set()
        since = stored_histories.start(21)
        for _ in range(2):  # asked twice
            operator_actions.inspect(session, alert, "Kimura", "confirmed", "two bearings replaced", since, NOW)
    stored_histories.do_waiting_work(sessions, NOW)
    with sessions() as session:
        (period,) = session.scalars(select(ReferencePeriod))
        assert (period.quantity, period.subject, period.start, period.author) == ("stiffness", None, since, "Kimura")
        (series,) = session.scalars(select(MonitoredSeries).where(MonitoredSeries.quantity == "stiffness"))
        assert (series.reference_id, series.baseline is None, series.wanted > 0) == (period.id, True, True)
        (alert,) = session.scalars(select(Alert).where(Alert.cause == "stiffness"))
        assert alert.state == "resolved"


def test_events_that_come_late_show_no_one_again_of_what_was_reported(
    sessions: sessionmaker[Session], building: int
) -> None:
    """With each of those between, another earthquake turns out to be the one that raised the alert."""
    found, raised = stored_histories.store_history(26, onset=21), set()
    for arrived in (*found[:21], *found[24:]), found[23:24], found[21:22], found[22:23]:
        stored_histories.store_and_monitor(sessions, building, arrived, NOW)
        with sessions() as session:
            (alert,) = session.scalars(select(Alert).where(Alert.cause == "stiffness"))
            raised.add(alert.raised_event_id)
            reported = session.scalars(select(Message).where(Message.kind == "alert").order_by(Message.id)).all()
    assert len(raised) > 1
    assert [one.sequence for one in reported] == ["new", *["updated"] * (len(reported) - 1)]
    assert {one.key for one in reported} == {reported[0].key}
    assert alert.began_at == stored_histories.start(21)
    assert reported[-1].data["alerts"][0]["began_at"] == stored_histories.start(21).isoformat()


def test_a_sensor_finding_excludes_its_events_values_and_is_reported(
    sessions: sessionmaker[Session], building: int
) -> None:
    """But for a sensor that was not recorded at all."""
    gone = Finding("missing", "warning", "was not recorded", BASE)
    late = Finding("clock", "warning", "its clock jumps", BASE)
    found = [
        replace(one, quality=(late,) if number >= 20 else (gone,))
        for number, one in enumerate(stored_histories.store_history(26, onset=20))
    ]
    stored_histories.store_and_monitor(sessions, building, found, NOW)
    with sessions() as session:
        question = select(DriftValue).join(MonitoredSeries).join(Event, Event.id == DriftValue.event_id)
        values = session.scalars(question.where(MonitoredSeries.quantity == "stiffness").order_by(Event.start)).all()
        assert [value.is_excluded for value in values] == [False] * 20 + [True] * 6
        assert "its clock jumps" in values[-1].causes
        assert session.scalars(select(Alert).where(Alert.cause == "stiffness")).all() == []


@pytest.mark.sqlite
def test_a_sensor_with_more_gain_raises_an_alert_about_itself(sessions: sessionmaker[Session], building: int) -> None:
    found = [stored_histories.earthquake(number, gain=1.08 if number >= 20 else 1.0) for number in range(24)]
    stored_histories.store_and_monitor(sessions, building, found, NOW)
    with sessions() as session:
        (alert,) = session.scalars(select(Alert).where(Alert.state == "active"))
    with sessions.begin() as session:
        again = session.get_one(Alert, alert.id)
        operator_actions.inspect(
            session, again, "Kimura", "confirmed", "its gain was set anew", stored_histories.start(20), NOW
        )
    stored_histories.do_waiting_work(sessions, NOW)
    with sessions() as session:
        wanted = {one.subject: one.wanted for one in session.scalars(select(MonitoredSeries)) if one.quantity == "gain"}
    assert wanted.pop(BASE) > 0
    assert set(wanted.values()) == {0}, "the other sensors are watched as before"
    assert (alert.cause, alert.kind, alert.channels) == (f"gain/{BASE}", "sensor", [BASE])
    assert alert.evidence["drift"] == pytest.approx(0.08, abs=0.01)
    assert f"Sensor {BASE} reads" in alert.summary


@pytest.mark.sqlite
def test_a_transducer_with_more_gain_is_no_loss_of_stiffness(sessions: sessionmaker[Session], building: int) -> None:
    """It makes the layer look equally softer; both changes are detected, and only the sensor is reported."""
    changed = {"loss": 1 - 1 / 1.08, "gain": 1.08, "swapped": LAYER}
    found = [stored_histories.earthquake(number, **(changed if number >= 20 else {})) for number in range(25)]
    stored_histories.store_and_monitor(sessions, building, found, NOW)
    with sessions() as session:
        states = {alert.cause: alert.state for alert in session.scalars(select(Alert))}
    assert states[f"gain/{LAYER}"] == "active"
    assert states["stiffness"] == "on_hold"
    assert "active" not in {state for cause, state in states.items() if not cause.startswith("gain/")}


def test_monitoring_again_writes_only_what_changed(sessions: sessionmaker[Session], building: int) -> None:
    found = stored_histories.store_history(26, onset=21)
    stored_histories.store_and_monitor(sessions, building, found[:-1], NOW)
    before = numbers_of_values(sessions)
    with drift_writes(sessions) as written:
        with sessions.begin() as session:
            job_queue.enqueue_monitoring(session, building, None, NOW)
        stored_histories.do_waiting_work(sessions, NOW)
    assert written == []
    assert numbers_of_values(sessions) == before
    with drift_writes(sessions) as written:
        stored_histories.store_and_monitor(sessions, building, found[-1:], NOW)
    after = numbers_of_values(sessions)
    assert {name: after[name] for name in before} == before
    assert len(after) == len(before) + len({name[:2] for name in before})
    assert not [statement for statement in written if statement.startswith("DELETE FROM drift_value")]


def test_the_statements_that_write_values_do_not_grow_with_the_events(
    sessions: sessionmaker[Session], building: int
) -> None:
    """All values are new, then all have changed."""
    stored_histories.store_and_monitor(sessions, building, stored_histories.store_history(24), NOW)
    with sessions.begin() as session:
        session.execute(delete(DriftValue))
        session.execute(delete(DriftState))
        job_queue.enqueue_monitoring(session, building, None, NOW)
    with drift_writes(sessions) as written:
        stored_histories.do_waiting_work(sessions, NOW)
    assert len([one for one in written if one.startswith("INSERT INTO drift_value")]) == 1
    with sessions.begin() as session:
        session.execute(update(DriftValue).values(std=99.0))
        session.execute(delete(DriftState))
        job_queue.enqueue_monitoring(session, building, None, NOW)
    with drift_writes(sessions) as written:
        stored_histories.do_waiting_work(sessions, NOW)
    assert [one.partition(" SET ")[0] for one in written] == ["UPDATE drift_value"]
    assert numbers_of_values(sessions)


def numbers_of_values(sessions: sessionmaker[Session]) -> dict[tuple[str, str, int], int]:
    """Row numbers of the drift values, by quantity, subject and event."""
    question = select(MonitoredSeries.quantity, MonitoredSeries.subject, DriftValue.event_id, DriftValue.id)
    with sessions() as session:
        return {(row[0], row[1], row[2]): row[3] for row in session.execute(question.join(DriftValue))}


@contextmanager
def drift_writes(sessions: sessionmaker[Session]) -> Iterator[list[str]]:
    """Statements that change drift values or alarms meanwhile."""
    written: list[str] = []

    def note(*given: str) -> None:
        if re.match(r"(INSERT INTO|UPDATE|DELETE FROM) drift_(value|alarm)", given[2]):
            written.append(given[2])

    with sessions() as session:
        engine = session.get_bind()
    sqlalchemy_event.listen(engine, "before_cursor_execute", note)
    try:
        yield written
    finally:
        sqlalchemy_event.remove(engine, "before_cursor_execute", note)
