"""Verdicts from the database: from stored earthquakes to messages, with everything that weakens them."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from math import hypot, sqrt

import pytest
from alert_candidates import gain_error, softer_isolators, stopped_data
from alert_fixtures import AGE, SOON, messages, with_stored_events
from assessed_buildings import STRONG, add_comparison, building, day, earthquake, shaking
from sqlalchemy.orm import Session

from service.alerts import operator_actions
from service.alerts.candidates import AlertCandidate
from service.alerts.messages import write_event_message, write_messages
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert, BuildingInspection
from service.analyses.tables import Analysis, DirectionResult, ShakingResult
from service.buildings.tables import Building
from service.drift.alert_candidates import limit_candidates
from service.drift.tables import DriftValue, MonitoredSeries, ReferencePeriod
from service.jobs import queue as job_queue
from service.notify.tables import Message
from service.records.tables import Event
from service.verdict import earthquakes, reading, texts
from service.verdict.assessment import Result
from service.verdict.checks import Check, Level, Outcome

GOOD = ("normal", "this is not an inspection", "nothing", "all clear")


def reported(session: Session, event: Event) -> Message:
    """The message about it, sent soon after."""
    write_event_message(session, event.id, AGE, event.end + SOON)
    return messages(session)[-1]


def printed(message: Message) -> str:
    """Everything that people read of it, in small letters."""
    return " ".join((message.severity, message.subject, *message.sentences)).lower()


def levels(session: Session, event: Event) -> set[Level]:
    """Levels of the earthquake and of its building."""
    session.flush()
    of = session.get_one(Building, event.building_id)
    return {reading.of_event(session, event).level, reading.of_building(session, of).level}


def test_an_earthquake_within_every_limit_is_normal_with_a_note_that_this_is_no_inspection(
    session: Session, of: Building
) -> None:
    event = earthquake(session, of, day(1))
    add_comparison(session, event)
    assert levels(session, event) == {Level.NORMAL}
    message = reported(session, event)
    assert (message.kind, message.severity) == ("event", "normal")
    assert message.subject.endswith(": isolators moved 20 mm, normal: 15 of 15 checks passed")
    assert message.sentences[-2:] == ["Normal. This does not replace an inspection.", "15 of 15 checks passed."]
    assert message.data["verdict"]["level"] == "normal"


def _without_y(session: Session, event: Event) -> None:
    session.delete(_result(session, event, "y"))


def _analysis(session: Session, event: Event) -> Analysis:
    return session.query(Analysis).filter_by(event_id=event.id).one()


def _result(session: Session, event: Event, direction: str) -> DirectionResult:
    return next(one for one in _analysis(session, event).directions if one.direction == direction)


def _values(**changed: object) -> Callable[[Session, Event], None]:
    def change(session: Session, event: Event) -> None:
        for value in session.query(DriftValue).filter_by(event_id=event.id):
            for name, new in changed.items():
                setattr(value, name, new)

    return change


def _of_result(**changed: object) -> Callable[[Session, Event], None]:
    def change(session: Session, event: Event) -> None:
        for name, new in changed.items():
            setattr(_result(session, event, "x"), name, new)

    return change


def _earlier(**changed: object) -> Callable[[Session, Event], None]:
    """The building's first earthquake left something else."""

    def change(session: Session, event: Event) -> None:
        first = session.query(Event).filter_by(building_id=event.building_id).order_by(Event.start).first()
        assert first is not None
        for name, new in changed.items():
            setattr(_result(session, first, "x"), name, new)

    return change


def _found(kind: str) -> Callable[[Session, Event], None]:
    """A warning of the data quality checks."""
    finding = {"kind": kind, "severity": "warning", "message": "a problem", "channel": "XX.A", "value": None}
    return lambda session, event: setattr(_analysis(session, event), "quality", [finding])


def _stopped(session: Session, event: Event) -> None:
    reconcile(session, event.building_id, [stopped_data("disk")], "clock", event.end)


def _pending(session: Session, event: Event) -> None:
    reconcile(session, event.building_id, [with_stored_events(gathering(), (event.id,) * 3)], "events", event.end)


def gathering() -> AlertCandidate:
    """Evidence of a loss that is not enough yet."""
    return softer_isolators(is_sure=False)


def _watching(session: Session, event: Event) -> None:
    job_queue.enqueue_monitoring(session, event.building_id, None, event.end)


WEAKER: dict[str, Callable[[Session, Event], None]] = {
    "a direction was rejected": _without_y,
    "no displacement": _of_result(peak_displacement=None),
    "unknown uncertainty": _of_result(peak_displacement_std=None),
    "no residual displacement": _of_result(residual_displacement=None),
    "an earlier offset is not known": _earlier(residual_displacement=None),
    "the error of an earlier offset is not known": _earlier(residual_displacement_std=None),
    "an earlier offset": _earlier(residual_displacement=-0.012),
    "a dead sensor": _found("dead"),
    "a clock that jumps": _found("clock"),
    "files that do not fit together": _found("record"),
    "it belongs to the reference": _values(is_reference=True),
    "amplitudes beyond the reference": _values(is_beyond=True),
    "a sensor keeps it out": _values(is_excluded=True),
    "never compared": lambda session, event: session.query(DriftValue).filter_by(event_id=event.id).delete() and None,
    "softer": _values(value=-0.3),
    "comparison under way": _watching,
    "analysed again": lambda session, event: setattr(event, "state", "queued"),
    "evidence gathers": _pending,
    "data stopped": _stopped,
}


@pytest.mark.parametrize("weakness", WEAKER)
def test_one_stored_weakness_is_enough(session: Session, of: Building, weakness: str) -> None:
    event = earthquake(session, of, day(1))
    add_comparison(session, event)
    assert levels(session, event) == {Level.NORMAL}
    WEAKER[weakness](session, event)
    session.flush()
    session.expire_all()
    assert Level.NORMAL not in levels(session, event)


@pytest.mark.parametrize("limits", ["design_displacement = 0.4", "moat_clearance = 0.5"])
def test_a_building_file_without_a_limit_leaves_its_check_undecided(session: Session, limits: str) -> None:
    event = earthquake(session, building(session, limits), day(1))
    add_comparison(session, event)
    message = reported(session, event)
    assert message.severity == "note"
    assert "undecided: 1 of 15 checks undecided" in message.subject
    assert "under [isolation] in the building file." in message.sentences[-1]
    assert not any(word in printed(message) for word in GOOD)


def test_data_problems_leave_it_undecided(session: Session, of: Building) -> None:
    event = earthquake(session, of, day(1), quality=("XX.A: 4 spikes were removed",))
    add_comparison(session, event)
    assert levels(session, event) == {Level.UNDECIDED}
    assert "Health of the sensors. XX.A: 4 spikes were removed." in reported(session, event).sentences[-1]


def test_the_message_of_a_later_earthquake_is_no_good_news_while_a_loss_is_open(session: Session, of: Building) -> None:
    """The isolators are 8 % softer, the alert is not acknowledged, and a moderate earthquake occurs."""
    events = tuple(earthquake(session, of, day(number)).id for number in (1, 2, 3))
    reconcile(session, of.id, [with_stored_events(softer_isolators(), events)], "events", day(3) + SOON)
    later = earthquake(session, of, day(10))
    add_comparison(session, later, -0.08, 0.004)
    message = reported(session, later)
    assert message.severity == "note"
    assert message.subject.endswith(
        "isolators moved 20 mm, watch: The isolators are 8 % softer in direction x; 1 alert open"
    )
    assert "Also open at the building: stiffness of the isolators." in message.sentences
    assert not any(word in printed(message) for word in GOOD)
    [alert] = message.data["verdict"]["open_alerts"]
    assert (alert["cause"], alert["level"], alert["rests_here"]) == ("stiffness", "watch", False)


def test_a_strong_earthquake_names_the_limits_it_exceeds(session: Session, of: Building) -> None:
    event = earthquake(session, of, day(1), STRONG)
    add_comparison(session, event)
    message = reported(session, event)
    assert message.severity == "alarm"
    assert "inspect: displacement as a share of the design displacement 73.8 %" in message.subject
    assert "Inspect. Have the building inspected before normal use." in message.sentences
    text = " ".join(message.sentences)
    assert "Shear strain of the isolators: 147.50 ± 0.14 %, limit 100 % (watch), Menshin's default" in text
    assert "design_displacement is 400 mm in the building file" in text
    assert not any(word in printed(message) for word in GOOD[1:])


def found_limits(session: Session, of: Building, now: object) -> None:
    """Result of the periodic check for exceeded limits."""
    reconcile(session, of.id, limit_candidates(session, of.id), "events", now)  # type: ignore[arg-type]
    session.flush()


def test_an_exceeded_limit_stays_open_until_an_inspection_is_recorded(session: Session, of: Building) -> None:
    strong = earthquake(session, of, day(1), STRONG)
    add_comparison(session, strong)
    found_limits(session, of, day(1) + SOON)
    write_messages(session, of.id, AGE, day(1) + SOON)
    alarm = messages(session)[-1]
    assert (alarm.key, alarm.kind, alarm.severity) == (f"event/{strong.id}", "alert", "alarm")
    assert " ".join(alarm.sentences).count("Have the building inspected") == 1
    assert "The alert stays until an inspection is recorded on its page." in alarm.sentences[1]
    assert alarm.link == f"/alerts/{session.query(Alert).one().id}"
    after = earthquake(session, of, day(2))
    add_comparison(session, after)
    found_limits(session, of, day(2) + SOON)
    assert levels(session, after) == {Level.INSPECT}
    assert reported(session, after).severity == "alarm"
    operator_actions.inspect(session, session.query(Alert).one(), "Jo", "confirmed", "no damage found", None, day(3))
    found_limits(session, of, day(3) + SOON)
    assert session.query(Alert).one().state == "resolved"
    assert levels(session, after) == {Level.NORMAL}
    again = earthquake(session, of, day(4), STRONG)
    found_limits(session, of, day(4) + SOON)
    assert [one.raised_event_id for one in session.query(Alert).order_by(Alert.id)] == [strong.id, again.id]


def _reshake(session: Session, event: Event, result: ShakingResult | None) -> None:
    """Another result in place of the earthquake's."""
    analysis = _analysis(session, event)
    session.delete(analysis.shaking)
    session.flush()
    session.expire(analysis)
    analysis.shaking = result
    session.flush()


@pytest.mark.parametrize("beyond", [{"drift": 0.016}, {"floor": 3.2}, {"intensity": 5.0}, {"long_period": 0.6}])
def test_aftershocks_inherit_strong_shaking_until_an_inspection(
    session: Session, of: Building, beyond: dict[str, float]
) -> None:
    """A drift of 1/250, 320 gal on the roof, intensity 5 or 60 cm/s of long period; the isolators moved little."""
    strong = earthquake(session, of, day(1))
    add_comparison(session, strong)
    _reshake(session, strong, shaking(**beyond))
    found_limits(session, of, day(1) + SOON)
    assert levels(session, strong) == {Level.INSPECT}
    after = earthquake(session, of, day(2))
    add_comparison(session, after)
    found_limits(session, of, day(2) + SOON)
    assert levels(session, after) == {Level.INSPECT}
    operator_actions.inspect(session, session.query(Alert).one(), "Jo", "confirmed", "no damage found", None, day(3))
    found_limits(session, of, day(3) + SOON)
    assert levels(session, after) == {Level.NORMAL}


def test_an_analysis_by_an_earlier_version_is_undecided_until_it_is_analysed_again(
    session: Session, of: Building
) -> None:
    event = earthquake(session, of, day(1))
    add_comparison(session, event)
    _reshake(session, event, None)
    assert levels(session, event) == {Level.UNDECIDED}
    unclear = reading.of_event(session, event).of_outcome(Outcome.UNDECIDED)
    assert {one.name for one in unclear} == {
        "storey_drift",
        "floor_acceleration",
        "jma_intensity",
        "long_period_class",
    }
    assert {one.remedy for one in unclear} == {"Analyse the event again."}


def test_the_designers_limits_count_and_are_named(session: Session) -> None:
    limits = '[limits]\nshear_strain = { inspect = 0.09, source = "maker" }\n'
    of = building(session, f"design_displacement = 0.4\nmoat_clearance = 0.5\n{limits}")
    event = earthquake(session, of, day(1))
    add_comparison(session, event)
    found_limits(session, of, day(1) + SOON)
    assert levels(session, event) == {Level.INSPECT}
    [check] = reading.of_event(session, event).of_outcome(Outcome.EXCEEDED)
    assert check.limits is not None
    assert check.limits.source.startswith("maker, in the building file")


def test_a_revised_analysis_withdraws_an_exceeded_limit(session: Session, of: Building) -> None:
    strong = earthquake(session, of, day(1), STRONG)
    found_limits(session, of, day(1) + SOON)
    analysis = _analysis(session, strong)
    analysis.layer.peak_resultant = 0.02  # type: ignore[union-attr]
    for one in analysis.directions:
        one.peak_displacement = 0.02
    analysis.created_at = day(2)
    session.flush()
    found_limits(session, of, day(2) + SOON)
    assert session.query(Alert).one().state == "withdrawn"


def test_an_alert_that_began_later_sends_no_message_about_an_earlier_earthquake_again(
    session: Session, of: Building
) -> None:
    first = earthquake(session, of, day(1))
    add_comparison(session, first)
    reported(session, first)
    second = earthquake(session, of, day(1) + timedelta(hours=1))
    found = replace(softer_isolators(), began_at=second.start, raised_at=second.start)
    reconcile(session, of.id, [with_stored_events(found, (second.id,) * 3)], "events", second.end)
    session.flush()
    write_event_message(session, first.id, AGE, second.end + SOON)
    assert [one.key for one in messages(session)] == [f"event/{first.id}"]
    assert reading.of_event(session, first).level is Level.WATCH
    _analysis(session, first).directions[0].peak_force = 2e6
    session.flush()
    write_event_message(session, first.id, AGE, second.end + SOON)
    updated = messages(session)[-1]
    assert (updated.number, updated.severity) == (2, "note")
    assert not any(word in printed(updated) for word in GOOD)


def test_a_verdict_states_that_the_analysis_is_pending(session: Session, of: Building) -> None:
    start = day(5)
    waiting = Event(building_id=of.id, start=start, end=start, state="queued", created_at=start, updated_at=start)
    session.add(waiting)
    assert levels(session, waiting) == {Level.UNDECIDED}
    found = reading.of_event(session, waiting)
    assert not found.of_outcome(Outcome.PASSED)
    assert {(one.reason, one.remedy) for one in found.checks} == {
        ("The earthquake has not been analysed yet.", "The analysis, which is under way.")
    }


def test_an_analysed_earthquake_waits_for_its_comparison_not_for_a_better_record(
    session: Session, of: Building
) -> None:
    event = earthquake(session, of, day(1))
    job_queue.enqueue_monitoring(session, of.id, None, day(1))
    changes = [one for one in reading.of_event(session, event).checks if one.name == "stiffness"]
    assert {one.remedy for one in changes} == {"The comparison, which is under way."}


def test_an_earthquake_before_a_new_reference_period_is_not_counted_in_it(session: Session, of: Building) -> None:
    event = earthquake(session, of, day(1))
    add_comparison(session, event)
    session.query(DriftValue).filter_by(event_id=event.id).delete()
    session.query(MonitoredSeries).update({"wanted": 20})
    session.flush()
    session.expire_all()
    changes = [one for one in reading.of_event(session, event).checks if one.name == "stiffness"]
    assert {one.reason for one in changes} == {"The reference period has too few earthquakes to compare this one with."}


def test_a_building_whose_recorder_is_silent_has_no_data(session: Session, of: Building) -> None:
    add_comparison(session, earthquake(session, of, day(1)))
    reconcile(session, of.id, [stopped_data()], "clock", day(2))
    session.flush()
    assert reading.of_building(session, of).level is Level.NO_DATA


def test_a_building_without_an_earthquake_has_no_data(session: Session) -> None:
    empty = building(session)
    for event in session.query(Event).filter_by(building_id=empty.id):
        event.building_id = building(session).id
    session.flush()
    found = reading.of_building(session, empty)
    assert (found.level, found.unusable) == (Level.NO_DATA, "No earthquake has been recorded yet.")


@pytest.mark.parametrize("state", ["refused", "failed"])
def test_an_earthquake_without_usable_records_has_no_data(session: Session, of: Building, state: str) -> None:
    event = earthquake(session, of, day(1))
    event.state, event.reason = state, "the base slab's record is missing"
    assert levels(session, event) == {Level.NO_DATA}
    assert "the base slab's record is missing" in reading.of_event(session, event).unusable


@pytest.mark.parametrize("result", [Result.FIT, Result.RESTRICTED])
def test_an_unseen_earthquake_counts_until_an_inspection(session: Session, of: Building, result: Result) -> None:
    missed, later = (earthquake(session, of, day(number)) for number in (1, 4))
    add_comparison(session, later)
    assert reading.of_building(session, of).level is Level.NORMAL
    missed.state, missed.reason = "refused", "the base slab's record is missing"
    found = reading.of_building(session, of)
    assert (found.level, found.unusable) == (Level.UNDECIDED, "")
    assert f"{missed.start:%Y-%m-%d %H:%M} UTC has no usable record" in texts.headline(found)
    assert "Only an inspection" in " ".join(texts.sentences(found))
    assert reading.of_event(session, later).level is Level.NORMAL, "the later one was seen"
    row = {"by": "Jo", "comment": "seen", "level": "undecided", "headline": "", "recorded_at": day(5)}
    session.add(BuildingInspection(building_id=of.id, result=result, inspected_at=day(0), **row))
    session.flush()
    assert reading.of_building(session, of).unseen, "an inspection before the earthquake tells nothing of it"
    session.add(BuildingInspection(building_id=of.id, result=result, inspected_at=day(2), **row))
    session.flush()
    settled = reading.of_building(session, of)
    assert (settled.unseen, settled.automatic) == ("", Level.NORMAL)


def test_a_sensor_that_measures_wrongly_leaves_it_undecided(session: Session, of: Building) -> None:
    event = earthquake(session, of, day(3))
    add_comparison(session, event)
    reconcile(session, of.id, [with_stored_events(gain_error(), (event.id,) * 3)], "events", day(3) + SOON)
    assert levels(session, event) == {Level.UNDECIDED}


def test_the_first_earthquake_has_no_history(session: Session, of: Building) -> None:
    [first] = session.query(Event).filter_by(building_id=of.id)
    found = reading.of_event(session, first)
    assert found.is_beyond_history
    assert {one.name for one in found.of_outcome(Outcome.UNDECIDED)} == {"stiffness", "largest_so_far"}


def test_many_earthquakes_at_once_have_the_verdicts_of_each(session: Session, of: Building) -> None:
    events = [
        earthquake(session, of, day(1)),
        earthquake(session, of, day(2), STRONG),
        earthquake(session, of, day(3), 0.05, quality=("XX.A: 4 spikes were removed",)),
        earthquake(session, of, day(4), 0.06),
    ]
    for event in events[:3]:
        add_comparison(session, event, 0.01)
    reconcile(session, of.id, [with_stored_events(softer_isolators(), (events[1].id,) * 3)], "events", day(2) + SOON)
    events[3].state, events[3].reason = "refused", "no channel of the base slab"
    session.flush()
    session.expire_all()
    for at in (None, day(2)):
        every = earthquakes.of_events(session, of, events, at)
        assert every == [reading.of_event(session, event, at) for event in events]
    assert len({one.level for one in every}) > 2


def check(session: Session, event: Event, name: str) -> Check:
    """A check of the earthquake, which is the same in a list and, of the last one, for its building."""
    session.flush()
    session.expire_all()
    of = session.get_one(Building, event.building_id)
    assert earthquakes.of_events(session, of, [event]) == [reading.of_event(session, event)]
    [found] = [one for one in reading.of_event(session, event).checks if one.name == name]
    last = session.query(Event).filter_by(building_id=of.id).order_by(Event.start.desc()).first()
    assert event is not last or found in reading.of_building(session, of).checks
    return found


def _left(session: Session, event: Event, x: float | None, y: float | None) -> None:
    for direction, value in (("x", x), ("y", y)):
        _result(session, event, direction).residual_displacement = value


def test_offsets_add_up_in_each_direction_until_a_new_reference_period(session: Session, of: Building) -> None:
    events = [*session.query(Event).filter_by(building_id=of.id), *(earthquake(session, of, day(n)) for n in (1, 2, 3))]
    for event, (x, y) in zip(events, [(0.006, 0.0), (0.009, 0.004), (-0.003, 0.004), (0.012, 0.002)], strict=True):
        _left(session, event, x, y)
    for event, x, y in zip(events, [0.006, 0.015, 0.012, 0.024], [0.0, 0.004, 0.008, 0.010], strict=True):
        found = [one for one in reading.of_event(session, event).checks if one.name == "rest_position"]
        assert found[0].value == pytest.approx(hypot(x, y))
    last = check(session, events[-1], "rest_position")
    assert last.level is Level.WATCH
    assert last.uncertainty == pytest.approx(2 * sqrt(2 * 4) * 2e-4), "four errors of 0.2 mm in each direction"
    assert last.note == "4 earthquakes since 2024-01-01"
    period = {"quantity": "residual_displacement", "end": None, "author": "Jo", "reason": "surveyed"}
    for subject, start in (("x", day(3)), (None, day(2))):
        session.add(ReferencePeriod(building_id=of.id, subject=subject, start=start, created_at=day(4), **period))
        session.flush()
    session.add(ReferencePeriod(building_id=of.id, quantity="stiffness", created_at=day(4), author="Jo", reason="-"))
    again = check(session, events[-1], "rest_position")
    assert again.value == pytest.approx(hypot(0.009, 0.006)), "the latest period that applies begins on day 2"
    assert again.note == "2 earthquakes since 2024-01-03"


def test_an_earthquake_before_the_reference_period_is_no_missing_transducer(session: Session, of: Building) -> None:
    """The remedy of a rest position that is not known is such a period after a survey."""
    event = earthquake(session, of, day(1))
    _left(session, event, 0.006, 0.002)
    period = {"quantity": "residual_displacement", "end": None, "author": "Jo", "reason": "surveyed"}
    session.add(ReferencePeriod(building_id=of.id, subject=None, start=day(2), created_at=day(3), **period))
    found = check(session, event, "rest_position")
    assert found.outcome is Outcome.UNDECIDED
    assert (
        found.reason
        == "The reference period of residual_displacement begins after this earthquake, which does not count."
    )
    assert found.remedy == "The next earthquake is the first that counts."


def test_an_offset_that_is_not_known_counts_until_an_inspection(session: Session, of: Building) -> None:
    missed, later = (earthquake(session, of, day(number)) for number in (1, 4))
    add_comparison(session, later)
    missed.state, missed.reason = "refused", "the base slab's record is missing"
    _analysis(session, missed).refusal = missed.reason
    found = check(session, later, "rest_position")
    assert found.outcome is Outcome.UNDECIDED
    assert found.value == pytest.approx(hypot(0.001, 0.001))
    assert found.reason == f"The offset in 1 earthquake is not known, the last of {missed.start:%Y-%m-%d %H:%M} UTC."
    assert "survey the rest position" in found.remedy
    row = {"by": "Jo", "comment": "seen", "level": "undecided", "headline": "", "recorded_at": day(5)}
    session.add(BuildingInspection(building_id=of.id, result=Result.FIT, inspected_at=day(2), **row))
    found = check(session, later, "rest_position")
    assert found.outcome is Outcome.PASSED
    assert found.note == "2 earthquakes since 2024-01-01, without 1 not recorded but inspected"
    assert levels(session, later) == {Level.NORMAL}


DAMPERS = """damper_stroke = 0.6
design_displacement = 0.4
moat_clearance = 0.5
[limits]
damper_travel = { watch = 2.5, inspect = 3.5, act = 5, source = "maker" }
"""


def test_the_travel_of_the_dampers_adds_up_and_lacks_what_was_not_recorded(session: Session) -> None:
    of = building(session, DAMPERS)
    events = [earthquake(session, of, day(number)) for number in (1, 2, 3)]
    for event in events:
        add_comparison(session, event)
    levels_of = [reading.of_event(session, event).level for event in events]
    assert levels_of == [Level.NORMAL, Level.WATCH, Level.INSPECT], "1 m in each, after 1 m in the first"
    found = check(session, events[-1], "damper_travel")
    assert found.value == 4.0
    assert found.uncertainty == pytest.approx(0.2)
    assert found.note == "4 earthquakes since 2024-01-01"
    found_limits(session, of, day(3) + SOON)
    [alert] = session.query(Alert)
    assert (alert.cause, alert.onset_event_id) == ("limits", events[-1].id)
    _analysis(session, events[0]).shaking.travel = None  # type: ignore[union-attr]
    found = check(session, events[-1], "damper_travel")
    assert (found.outcome, found.value, found.level) == (Outcome.EXCEEDED, 3.0, Level.UNDECIDED)
    assert found.reason == f"The path in 1 earthquake is not known, the last of {events[0].start:%Y-%m-%d %H:%M} UTC."
    found = check(session, events[1], "damper_travel")
    assert (found.outcome, found.value) == (Outcome.UNDECIDED, 2.0), "a lower bound passes no limit"


def test_dampers_without_a_limit_of_their_travel_show_how_far_they_went(session: Session) -> None:
    event = earthquake(session, building(session, "damper_stroke = 0.6\n"), day(1))
    found = check(session, event, "damper_travel")
    assert (found.outcome, found.value, found.limits) == (Outcome.UNDECIDED, 2.0, None)
    assert found.remedy.startswith("Give damper_travel under [limits]")


def test_offsets_that_add_up_beyond_a_limit_stay_open_until_an_inspection(session: Session, of: Building) -> None:
    """Later earthquakes may move the isolators back: without an alert the level would fall by itself."""
    small, back = (earthquake(session, of, day(number)) for number in (1, 2))
    for event, x in ((small, 0.031), (back, -0.02)):
        _left(session, event, x, 0.0)
        add_comparison(session, event)
    _left(session, session.query(Event).filter_by(building_id=of.id).order_by(Event.start)[0], 0.004, 0.0)
    _left(session, small, 0.028, 0.0)
    found_limits(session, of, day(2) + SOON)
    assert check(session, small, "residual_displacement").level is Level.WATCH
    assert check(session, small, "rest_position").level is Level.INSPECT
    assert check(session, back, "rest_position").level is Level.WATCH
    assert levels(session, back) == {Level.INSPECT}
    [alert] = session.query(Alert)
    assert alert.onset_event_id == small.id
    assert "Rest position" in alert.summary
    operator_actions.inspect(session, alert, "Jo", "confirmed", "bearings turned back", None, day(3))
    found_limits(session, of, day(3) + SOON)
    assert levels(session, back) == {Level.WATCH}
