"""Messages about an earthquake: first, updated, and not repeated."""

from datetime import timedelta

import pytest
from alert_candidates import DAY, START
from alert_fixtures import AGE, SOON, analysed, earthquake, messages, raise_softening
from sqlalchemy.orm import Session

from service.alerts import operator_actions
from service.alerts.messages import write_event_message, write_messages
from service.alerts.tables import Alert
from service.analyses.tables import DirectionResult
from service.buildings.tables import Building
from service.jobs import queue as job_queue


def test_an_earthquake_is_reported_once_in_local_time_with_what_is_undecided(session: Session, of: Building) -> None:
    event = earthquake(session, of, START, 0.0237)
    for _ in range(3):
        write_event_message(session, event.id, AGE, START + SOON)
    (reported,) = messages(session)
    assert (reported.key, reported.kind, reported.sequence, reported.severity) == (
        f"event/{event.id}",
        "event",
        "new",
        "note",
    )
    assert reported.subject.startswith(
        "Earthquake of 1 January 2024, 09:00 (JST): isolators moved at least 24 mm, undecided: 11 of 14"
    )
    assert "moved by at least 24 mm, in direction x; how far they moved in plan is not known" in reported.sentences[0]
    assert reported.sentences[1].startswith(
        "Undecided. Menshin cannot decide whether the building is within its limits"
    )
    assert reported.sentences[2] == "3 of 14 checks passed."
    assert (
        "Undecided: Change of stiffness, direction x. This earthquake has not been compared" in reported.sentences[-1]
    )
    assert {"name": "Check: Residual displacement", "value": "undecided"} in reported.facts
    assert reported.data["verdict"]["level"] == "undecided"
    assert {"name": "Largest isolator displacement, direction x", "value": "23.7 mm"} in reported.facts
    assert reported.data["peak_displacement"] == {"x": 0.0237}
    assert reported.picture_direction == "x"
    assert reported.link == f"/events/{event.id}"


@pytest.mark.parametrize(
    ("value", "std", "expected"),
    [
        (-0.0004123e-3, 0.0025e-3, "−0.0004 ± 0.0025 mm"),
        (12.3456e-3, 3.21e-3, "12.3 ± 3.2 mm"),
        (12.3456e-3, None, "12.3 mm"),
        (0.0, None, "0 mm"),
    ],
)
def test_a_residual_displacement_is_written_to_the_digit_that_its_uncertainty_supports(
    session: Session, of: Building, value: float, std: float | None, expected: str
) -> None:
    event = earthquake(session, of, START)
    (found,) = session.query(DirectionResult).all()
    found.residual_displacement, found.residual_displacement_std = value, std
    write_event_message(session, event.id, AGE, START + SOON)
    (reported,) = messages(session)
    assert {"name": "Residual displacement, direction x", "value": expected} in reported.facts
    assert reported.data["residual_displacement"] == {"x": value}


def test_a_new_analysis_is_reported_only_if_its_result_differs(session: Session, of: Building) -> None:
    event = earthquake(session, of, START, 0.0237)
    write_event_message(session, event.id, AGE, START + SOON)
    analysed(session, event, START + 2 * SOON, 0.0237 + 1e-6)
    write_event_message(session, event.id, AGE, START + 2 * SOON)
    assert len(messages(session)) == 1
    analysed(session, event, START + 3 * SOON, 0.031)
    write_event_message(session, event.id, AGE, START + 3 * SOON)
    assert [(one.sequence, one.severity) for one in messages(session)] == [
        ("new", "note"),
        ("updated", "note"),
    ]
    assert "31 mm" in messages(session)[1].subject


def test_an_event_whose_records_turn_out_useless_is_cancelled(session: Session, of: Building) -> None:
    event = earthquake(session, of, START)
    write_event_message(session, event.id, AGE, START + SOON)
    analysed(session, event, START + 2 * SOON, refusal="the base slab's record is missing.")
    for _ in range(3):
        write_event_message(session, event.id, AGE, START + 2 * SOON)
    first, second = messages(session)
    assert (first.sequence, second.sequence, second.severity) == ("new", "cancelled", "warning")
    assert "cannot be used: the base slab's record is missing." in second.sentences[0]


def test_a_refused_event_is_reported_and_not_cancelled(session: Session, of: Building) -> None:
    event = earthquake(session, of, START)
    analysed(session, event, START, refusal="the base slab's record is missing")
    for _ in range(2):
        write_event_message(session, event.id, AGE, START + SOON)
    (reported,) = messages(session)
    assert (reported.sequence, reported.severity) == ("new", "warning")


def test_an_unmeasured_displacement_is_reported_as(session: Session, of: Building) -> None:
    event = earthquake(session, of, START, None)
    write_event_message(session, event.id, AGE, START + SOON)
    (reported,) = messages(session)
    assert "was not measured" in reported.sentences[0]
    assert reported.picture_direction is None


def test_an_event_that_is_still_analysed_is_not_reported(session: Session, of: Building) -> None:
    event = earthquake(session, of, START)
    event.state = "queued"
    write_event_message(session, event.id, AGE, START + SOON)
    assert messages(session) == []


def test_an_earthquake_that_comes_late_is_not_called_harmless(session: Session, of: Building) -> None:
    """It lies between the onset of a reported loss and the earthquake that it was reported with."""
    events, now = raise_softening(session, of), START + 3 * DAY
    write_messages(session, of.id, timedelta(minutes=1), now)
    late = earthquake(session, of, START + DAY / 2)
    write_event_message(session, late.id, AGE * 2, now + SOON)
    reported = messages(session)[-1]
    assert reported.key == f"event/{late.id}" != f"event/{events[2]}"
    assert "Also open at the building: stiffness of the isolators." in reported.sentences[-1]


def test_a_new_event_mentions_silenced_alerts(session: Session, of: Building) -> None:
    raise_softening(session, of)
    now = START + 3 * DAY
    operator_actions.silence(session, of, "stiffness/x", now + DAY, "a load test", "Jo", now)
    write_messages(session, of.id, AGE, now)
    reported = messages(session)[-1]
    assert (reported.kind, reported.severity) == ("event", "note")
    assert reported.data["verdict"]["level"] == "undecided"
    assert "a load test" in " ".join(reported.sentences)
    assert reported.data["alerts"] == []


def test_a_later_event_names_active_alerts_without_reporting_them_again(session: Session, of: Building) -> None:
    raise_softening(session, of)
    later = earthquake(session, of, START + 10 * DAY)
    now = START + 10 * DAY + SOON
    write_event_message(session, later.id, AGE, now)
    (reported,) = messages(session)
    assert reported.severity == "note"
    assert "Also open at the building: stiffness of the isolators." in reported.sentences[-1]
    operator_actions.inspect(session, session.query(Alert).one(), "Jo", "confirmed", "replaced", None, now + SOON)
    write_event_message(session, later.id, AGE, now + SOON)
    assert len(messages(session)) == 1


def test_nothing_is_stated_of_earthquakes_while_a_look_for_drift_waits(session: Session, of: Building) -> None:
    raise_softening(session, of)
    job = job_queue.enqueue_monitoring(session, of.id, None, START)
    write_messages(session, of.id, AGE, START + 1000 * DAY)
    assert messages(session) == []
    job.state = "failed"
    write_messages(session, of.id, AGE, START + 1000 * DAY)
    assert len(messages(session)) == 1
