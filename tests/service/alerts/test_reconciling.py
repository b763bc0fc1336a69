"""Stored alerts come to what is found, whatever came before, and keep their history."""

from dataclasses import replace
from datetime import datetime, timedelta

import pytest
from alert_candidates import START, gain_error, softer_isolators, stopped_data
from alert_fixtures import analysed, building, open_alerts, three_earthquakes
from hypothesis import HealthCheck, example, given, settings, strategies as st
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.candidates import AlertCandidate
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert, AlertChange
from service.buildings.tables import Building
from service.errors import ConflictError
from service.records.tables import Event

NOW = START + timedelta(days=30)
STEP = timedelta(hours=1)
OFFERED = {
    "softer": softer_isolators(),
    "much softer": softer_isolators(20.0),
    "softer, as it seems": softer_isolators(is_sure=False),
    "a gain": gain_error(),
    "a gain, as it seems": gain_error(is_sure=False),
    "another sensor's": gain_error("XX.DEMO.05.HNX"),
}
Lists = tuple[tuple[str, ...], str | None]
"""Candidates at one time, and a later action by an operator."""


def found(names: tuple[str, ...], events: tuple[int, int, int]) -> list[AlertCandidate]:
    """The findings of these names, one of a cause at most, of a building's own earthquakes."""
    by_cause = {OFFERED[name].cause: OFFERED[name] for name in names}
    return [
        replace(
            one,
            onset_event_id=events[0],
            raised_event_id=events[(one.raised_event_id or 1) - 1],
            event_ids=tuple(events[number - 1] for number in one.event_ids),
        )
        for one in by_cause.values()
    ]


def run(session: Session, steps: list[Lists]) -> tuple[Building, set[tuple[object, ...]]]:
    """A building of its own to which these steps happen; before each one the data of its first event are revised."""
    of = building(session)
    events = three_earthquakes(session, of)
    first = session.get_one(Event, events[0])
    for number, (names, act) in enumerate(steps):
        now = NOW + number * STEP
        analysed(session, first, now - STEP / 2)
        reconcile(session, of.id, found(names, events), "events", now)
        session.flush()
        _act(session, of, act, now)
    return of, open_alerts(session, of)


def _act(session: Session, of: Building, act: str | None, now: datetime) -> None:
    standing = (Alert.building_id == of.id, Alert.cause == "stiffness", Alert.state.in_(("active", "acknowledged")))
    alert = session.scalars(select(Alert).where(*standing, Alert.closed_at.is_(None))).one_or_none()
    if alert is not None and act == "acknowledge":
        operator_actions.acknowledge(session, alert, "Jo", "on my way", now)
    if alert is not None and act == "inspect":
        operator_actions.inspect(session, alert, "Jo", "confirmed", "looked at", None, now)
    session.flush()


names = st.lists(st.sampled_from(sorted(OFFERED)), max_size=3).map(tuple)
lists = st.tuples(names, st.sampled_from([None, None, None, "acknowledge", "inspect"]))


@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(before=st.lists(lists, max_size=4), last=names)
@example(before=[(("softer",), "acknowledge"), ((), None)], last=("softer",))
@example(before=[(("softer",), "inspect"), ((), None)], last=("much softer", "a gain"))
def test_what_came_on_the_way_does_not_matter(
    sessions: sessionmaker[Session], before: list[Lists], last: tuple[str, ...]
) -> None:
    """The same end with the same human acts: the same open alerts, however often the findings changed on the way."""
    with sessions.begin() as session:
        _, wandering = run(session, [*before, (last, None)])
        _, straight = run(session, [*(step for step in before if step[1] is not None), (last, None)])
        assert wandering == straight


def test_repeating_changes_nothing(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        events = three_earthquakes(session, of)
        for _ in range(3):
            reconcile(session, of.id, found(("softer", "a gain"), events), "events", NOW)
            session.flush()
            assert session.query(AlertChange).count() == 2
            assert {row[1] for row in open_alerts(session, of)} == {"on_hold", "active"}


def test_drift_raises_an_alert_once_the_sensor_finding_is_resolved(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        events = three_earthquakes(session, of)
        reconcile(session, of.id, found(("softer", "a gain"), events), "events", NOW)
        session.flush()
        sensor = session.scalars(select(Alert).where(Alert.kind == "sensor")).one()
        operator_actions.inspect(
            session, sensor, "Jo", "confirmed", "its new gain stands in the file", None, NOW + STEP
        )
        reconcile(session, of.id, found(("softer", "a gain"), events), "events", NOW + 2 * STEP)
        session.flush()
        drift = session.scalars(select(Alert).where(Alert.kind == "deterioration")).one()
        assert [change.state for change in drift.changes] == ["on_hold", "active"]
        assert drift.activated_at == NOW + 2 * STEP


def test_deterioration_stays_without_new_data_and_is_withdrawn_by_them(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        events = three_earthquakes(session, of)
        reconcile(session, of.id, found(("softer",), events), "events", NOW)
        session.flush()
        reconcile(session, of.id, [], "events", NOW + STEP)
        assert {row[1] for row in open_alerts(session, of)} == {"active"}
        analysed(session, session.get_one(Event, events[1]), NOW + 2 * STEP)
        reconcile(session, of.id, [], "events", NOW + 3 * STEP)
        session.flush()
        alert = session.query(Alert).one()
        assert (alert.state, alert.closed_at) == ("withdrawn", NOW + 3 * STEP)
        assert "revised" in alert.changes[-1].note


def test_the_scopes_leave_each_other_alone(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        events = three_earthquakes(session, of)
        reconcile(session, of.id, found(("softer",), events), "events", NOW)
        reconcile(session, of.id, [stopped_data()], "clock", NOW)
        reconcile(session, of.id, [], "clock", NOW + STEP)
        session.flush()
        assert {(a.cause, a.state) for a in session.query(Alert)} == {("stiffness", "active"), ("source", "resolved")}
        with pytest.raises(ValueError, match="not about"):
            reconcile(session, of.id, [stopped_data()], "events", NOW)
        with pytest.raises(ValueError, match="twice"):
            reconcile(session, of.id, [stopped_data(), stopped_data()], "clock", NOW)


def test_an_inspection_ends_an_alert_and_is_safe_to_repeat(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = building(session)
        reconcile(session, of.id, [stopped_data()], "clock", NOW)
        session.flush()
        alert = session.query(Alert).one()
        operator_actions.acknowledge(session, alert, "Jo", "calling them", NOW)
        operator_actions.acknowledge(session, alert, "Al", "me too", NOW + STEP)
        assert (alert.acknowledged_by, alert.acknowledgement) == ("Jo", "calling them")
        assert operator_actions.inspect(session, alert, "Jo", "unfounded", "maintenance", None, NOW + STEP)
        assert operator_actions.inspect(session, alert, "Jo", "unfounded", "maintenance", None, NOW + 2 * STEP) is None
        assert [change.state for change in alert.changes] == ["active", "acknowledged", "withdrawn"]
        for act in (
            lambda: operator_actions.acknowledge(session, alert, "Al", "", NOW),
            lambda: operator_actions.inspect(session, alert, "Al", "confirmed", "broken", None, NOW),
        ):
            with pytest.raises(ConflictError, match="withdrawn"):
                act()
