"""Messages about the alerts that an earthquake raised."""

import pytest
from alert_candidates import DAY, START, gain_error, softer_isolators
from alert_fixtures import AGE, SOON, analysed, messages, raise_softening, three_earthquakes, with_stored_events
from sqlalchemy.orm import Session

from service.alerts import operator_actions
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings.tables import Building
from service.records.tables import Event


def test_an_import_of_years_shows_its_alert_alone(session: Session, of: Building) -> None:
    events = raise_softening(session, of)
    for _ in range(3):
        write_messages(session, of.id, AGE, START + 1000 * DAY)
    (reported,) = messages(session)
    assert (reported.key, reported.kind, reported.severity) == (f"event/{events[2]}", "alert", "alarm")
    assert reported.subject.endswith(": The isolators are 8 % softer in direction x")
    assert "ought to be looked at" in " ".join(reported.sentences)
    assert reported.link == f"/alerts/{session.query(Alert).one().id}"


def test_alerts_of_one_earthquake_are_one_message(session: Session, of: Building) -> None:
    events = three_earthquakes(session, of)
    found = (
        softer_isolators(),
        softer_isolators(cause="damping/x", summary="The isolators damp 9 % less in direction x"),
    )
    reconcile(session, of.id, [with_stored_events(one, events) for one in found], "events", START + 3 * DAY)
    session.flush()
    write_messages(session, of.id, AGE, START + 1000 * DAY)
    (reported,) = messages(session)
    assert reported.subject.endswith("softer in direction x (and 1 more)")
    assert len(reported.data["alerts"]) == 2
    assert reported.link == f"/buildings/{of.code}/alerts"


def test_acknowledging_is_no_news_and_an_inspection_is(session: Session, of: Building) -> None:
    raise_softening(session, of)
    alert, now = session.query(Alert).one(), START + 1000 * DAY
    write_messages(session, of.id, AGE, now)
    operator_actions.acknowledge(session, alert, "Jo", "on my way", now)
    write_messages(session, of.id, AGE, now)
    assert len(messages(session)) == 1
    operator_actions.inspect(session, alert, "Jo", "confirmed", "bearings 3 and 4 were replaced", None, now + DAY)
    for _ in range(2):
        write_messages(session, of.id, AGE, now + DAY)
    _, reported = messages(session)
    assert (reported.sequence, reported.severity) == ("updated", "note")
    assert "Resolved: " in " ".join(reported.sentences)
    assert "Jo: bearings 3 and 4 were replaced" in " ".join(reported.sentences)


@pytest.mark.parametrize("how", ["data", "review"])
def test_an_alert_that_never_was_is_cancelled(session: Session, of: Building, how: str) -> None:
    events, now = raise_softening(session, of), START + 1000 * DAY
    write_messages(session, of.id, AGE, now)
    if how == "data":
        analysed(session, session.get_one(Event, events[1]), now)
        reconcile(session, of.id, [], "events", now + SOON)
    else:
        operator_actions.inspect(session, session.query(Alert).one(), "Jo", "unfounded", "a test load", None, now)
    session.flush()
    for _ in range(2):
        write_messages(session, of.id, AGE, now + SOON)
    _, reported = messages(session)
    assert (reported.sequence, reported.severity) == ("cancelled", "note")
    assert "Cancelled, because the alert was wrong: " in " ".join(reported.sentences)


def test_what_a_sensor_may_explain_is_reported_so(session: Session, of: Building) -> None:
    events = raise_softening(session, of, gain_error(began_at=START + 2 * DAY, raised_event_id=3))
    write_messages(session, of.id, AGE, START + 1000 * DAY)
    (reported,) = messages(session)
    assert reported.key == f"event/{events[2]}"
    assert (reported.kind, reported.severity) == ("alert", "warning")
    assert "a sensor used for this result is faulty" in " ".join(reported.sentences)


def test_what_is_silenced_is_reported_when_the_silence_ends(session: Session, of: Building) -> None:
    raise_softening(session, of)
    now = START + 1000 * DAY
    operator_actions.silence(session, of, "stiffness/*", now + DAY, "a load test", "Jo", now)
    write_messages(session, of.id, AGE, now)
    assert messages(session) == []
    write_messages(session, of.id, AGE, now + DAY)
    (reported,) = messages(session)
    assert reported.severity == "alarm"
