"""Messages about earthquakes whose alerts have ended: no work while nothing changes, an update when something does."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from alert_candidates import gain_error, softer_isolators
from alert_fixtures import AGE, SOON, messages
from assessed_buildings import add_comparison, building, building_file, day, earthquake
from sqlalchemy import event as listening
from sqlalchemy.orm import Session

from service.alerts import operator_actions
from service.alerts.messages import write_event_message, write_messages
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert, BuildingInspection
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.drift.tables import DriftValue, ReferencePeriod
from service.notify.tables import Message
from service.records.tables import Event

LATER = day(1000)


@pytest.fixture
def of(session: Session) -> Building:
    return building(session)


def report(session: Session, of: Building, event: Event) -> None:
    """A message about a loss that the earthquake showed."""
    found = softer_isolators(
        began_at=event.start,
        raised_at=event.start,
        onset_event_id=event.id,
        raised_event_id=event.id,
        event_ids=(event.id,),
    )
    reconcile(session, of.id, [found], "events", event.end)
    write(session, of, event.end)


def write(session: Session, of: Building, now: datetime) -> None:
    session.flush()
    write_messages(session, of.id, AGE, now)


def inspect(session: Session, now: datetime) -> None:
    [alert] = session.query(Alert).filter(Alert.closed_at.is_(None))
    operator_actions.inspect(session, alert, "Jo", "confirmed", "no damage found", None, now)


def ended(session: Session, of: Building, number: int) -> Event:
    """An earthquake that was reported with an alert, whose end was reported too."""
    event = earthquake(session, of, day(10 * number))
    add_comparison(session, event)
    report(session, of, event)
    inspect(session, event.end + SOON)
    write(session, of, event.end + SOON)
    return event


def statements(session: Session, of: Building) -> int:
    """Number of SQL statements by which nothing is found to write."""
    session.expire_all()
    executed: list[str] = []

    def note(_1: object, _2: object, statement: str, *_3: object) -> None:
        executed.append(statement)

    connection, before = session.connection(), len(messages(session))
    listening.listen(connection, "before_cursor_execute", note)
    write(session, of, LATER)
    listening.remove(connection, "before_cursor_execute", note)
    assert len(messages(session)) == before
    return len(executed)


def test_earthquakes_that_were_once_reported_take_no_statements_of_their_own(session: Session, of: Building) -> None:
    """50 of them took 2468 statements when each was read by itself."""
    few, many = 0, 0
    for number in range(1, 13):
        ended(session, of, number)
        many = statements(session, of)
        few = few or many
    assert len(messages(session)) == 24
    assert many == few < 50


def _analysis(session: Session, event: Event) -> Analysis:
    return session.query(Analysis).filter_by(event_id=event.id).one()


def _moved_further(session: Session, _: Building, event: Event) -> None:
    _analysis(session, event).layer.peak_resultant = 0.03  # type: ignore[union-attr]


def _pushed_harder(session: Session, _: Building, event: Event) -> None:
    _analysis(session, event).directions[0].peak_force = 2e6


def _refused(session: Session, _: Building, event: Event) -> None:
    event.state, event.reason = "refused", "no channel of the base slab"
    _analysis(session, event).refusal = event.reason


def _data_problem(session: Session, _: Building, event: Event) -> None:
    finding = {"kind": "dead", "severity": "warning", "message": "a problem", "channel": "XX.A", "value": None}
    _analysis(session, event).quality = [finding]


def _another_baseline(session: Session, _: Building, event: Event) -> None:
    for value in session.query(DriftValue).filter_by(event_id=event.id):
        value.value = -0.3


def _not_compared(session: Session, _: Building, event: Event) -> None:
    session.query(DriftValue).filter_by(event_id=event.id).delete()


def _stronger_before(session: Session, of: Building, event: Event) -> None:
    earthquake(session, of, event.start - timedelta(days=1), 0.2)


def _weaker_before(session: Session, of: Building, _: Event) -> None:
    """The largest displacement so far was smaller than known."""
    first = session.query(Event).filter_by(building_id=of.id).order_by(Event.start).first()
    assert first is not None
    _analysis(session, first).layer.peak_resultant = 0.001  # type: ignore[union-attr]


def _unknown_offset_before(session: Session, of: Building, event: Event) -> None:
    late = earthquake(session, of, event.start - timedelta(days=1))
    for one in _analysis(session, late).directions:
        one.residual_displacement = None


def _survey(session: Session, of: Building, event: Event) -> None:
    later = event.start + timedelta(days=1)
    period = ReferencePeriod(
        building_id=of.id,
        quantity="residual_displacement",
        start=later,
        author="Jo",
        reason="a survey",
        created_at=later,
    )
    session.add(period)


def _inspected_after_an_unknown_offset(session: Session, of: Building, event: Event) -> None:
    """Two changes; the first one is reported before."""
    _unknown_offset_before(session, of, event)
    write(session, of, LATER - SOON)
    inspection = BuildingInspection(
        building_id=of.id,
        inspected_at=LATER,
        recorded_at=LATER,
        by="Jo",
        result="fit",
        comment="",
        level="watch",
        headline="",
    )
    session.add(inspection)


def _another_limit(session: Session, of: Building, _: Event) -> None:
    limits = '[limits]\nshear_strain = { inspect = 0.09, source = "maker" }\n'
    text = building_file(of.code, f"design_displacement = 0.4\nmoat_clearance = 0.5\n{limits}")
    building_store.update_description(session, text, Path("/"), LATER)


def _another_name(session: Session, of: Building, _: Event) -> None:
    text = building_file(of.code).replace("a tower", "another tower")
    building_store.update_description(session, text, Path("/"), LATER)


def _another_alert(session: Session, of: Building, event: Event) -> None:
    found = replace(
        gain_error(), onset_event_id=event.id, raised_event_id=event.id, event_ids=(event.id,), began_at=event.start
    )
    reconcile(session, of.id, [found], "events", LATER)


CHANGES: dict[str, Callable[[Session, Building, Event], None]] = {
    "a larger displacement": _moved_further,
    "a larger force": _pushed_harder,
    "records that cannot be used after all": _refused,
    "a data problem": _data_problem,
    "another baseline": _another_baseline,
    "not compared any more": _not_compared,
    "a stronger earthquake before, which comes late": _stronger_before,
    "a weaker earthquake before": _weaker_before,
    "an unknown offset before": _unknown_offset_before,
    "another reference period": _survey,
    "an inspection of the building": _inspected_after_an_unknown_offset,
    "another limit": _another_limit,
    "another name": _another_name,
    "another alert": _another_alert,
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_changes_later_is_reported_all_the_same(session: Session, of: Building, change: str) -> None:
    """Nothing is left that the event's own message, written by itself, would report."""
    event = [ended(session, of, number) for number in (1, 2)][-1]
    CHANGES[change](session, of, event)
    session.flush()
    session.expire_all()
    before = {one.id for one in messages(session)}
    write(session, of, LATER)
    then = messages(session)
    assert f"event/{event.id}" in {one.key for one in then if one.id not in before}
    _write_each(session, of)
    assert messages(session) == then


def test_the_end_of_an_alert_is_reported_once_with_the_earthquake_that_it_was_reported_with(
    session: Session, of: Building
) -> None:
    ended(session, of, 1)
    event = earthquake(session, of, day(30))
    report(session, of, event)
    before = messages(session)
    inspect(session, LATER)
    for _ in range(2):
        write(session, of, LATER)
    [end] = messages(session)[len(before) :]
    assert (end.key, end.kind, end.sequence) == (f"event/{event.id}", "alert", "updated")
    assert "no damage found" in " ".join(end.sentences)


def _write_each(session: Session, of: Building) -> None:
    for event in session.query(Event).filter_by(building_id=of.id).order_by(Event.start):
        if session.query(Message).filter_by(key=f"event/{event.id}").count():
            write_event_message(session, event.id, AGE, LATER)
