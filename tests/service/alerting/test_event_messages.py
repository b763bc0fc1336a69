"""What people are told of earthquakes: first, again, and not again."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta

import pytest
from alarmed import analysed, building, earthquake, three_earthquakes
from findings import DAY, START, gain, softer
from sqlalchemy.orm import Session, sessionmaker

from service.alerting import handling
from service.alerting.event_messages import tell, tell_of_event
from service.alerting.found import Found
from service.alerting.reconciling import reconcile
from service.database import Alert, Building, DriftValue, Event, Message, WatchedSeries
from service.queue import jobs

AGE = timedelta(days=2)
SOON = timedelta(minutes=10)


@pytest.fixture
def session(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions.begin() as opened:
        yield opened


@pytest.fixture
def of(session: Session) -> Building:
    return building(session)


def messages(session: Session) -> list[Message]:
    session.flush()
    return session.query(Message).order_by(Message.id).all()


def test_all_clear_is_told_once_in_local_time(session: Session, of: Building) -> None:
    event = earthquake(session, of, START, 0.0237)
    for _ in range(3):
        tell_of_event(session, event.id, AGE, START + SOON)
    (told,) = messages(session)
    assert (told.key, told.kind, told.sequence, told.severity) == (f"event/{event.id}", "event", "new", "all_clear")
    assert told.subject == "Earthquake of 1 January 2024, 09:00 (JST): isolators moved 24 mm, nothing unusual"
    assert "moved by 24 mm at most" in told.sentences[0]
    assert told.sentences[1] == "Nothing unusual was found; nothing has to be done."
    assert "those before are too few" in told.sentences[2]
    assert {"name": "Largest isolator displacement, direction x", "value": "23.7 mm"} in told.facts
    assert told.data["peak_displacement"] == {"x": 0.0237}
    assert told.picture_direction == "x"


def test_a_new_analysis_is_told_only_if_it_says_something_else(session: Session, of: Building) -> None:
    event = earthquake(session, of, START, 0.0237)
    tell_of_event(session, event.id, AGE, START + SOON)
    analysed(session, event, START + 2 * SOON, 0.0237 + 1e-6)
    tell_of_event(session, event.id, AGE, START + 2 * SOON)
    assert len(messages(session)) == 1
    analysed(session, event, START + 3 * SOON, 0.031)
    tell_of_event(session, event.id, AGE, START + 3 * SOON)
    assert [(one.sequence, one.severity) for one in messages(session)] == [
        ("new", "all_clear"),
        ("updated", "all_clear"),
    ]
    assert "31 mm" in messages(session)[1].subject


def test_an_event_whose_records_turn_out_useless_is_cancelled(session: Session, of: Building) -> None:
    event = earthquake(session, of, START)
    tell_of_event(session, event.id, AGE, START + SOON)
    analysed(session, event, START + 2 * SOON, refusal="the base slab's record is missing.")
    for _ in range(3):
        tell_of_event(session, event.id, AGE, START + 2 * SOON)
    first, second = messages(session)
    assert (first.sequence, second.sequence, second.severity) == ("new", "cancelled", "note")
    assert "cannot be used: the base slab's record is missing." in second.sentences[0]


def test_a_refused_event_is_told_and_not_cancelled(session: Session, of: Building) -> None:
    event = earthquake(session, of, START)
    analysed(session, event, START, refusal="the base slab's record is missing")
    for _ in range(2):
        tell_of_event(session, event.id, AGE, START + SOON)
    (told,) = messages(session)
    assert (told.sequence, told.severity) == ("new", "note")


def test_an_unmeasured_displacement_is_said_to_be(session: Session, of: Building) -> None:
    event = earthquake(session, of, START, None)
    tell_of_event(session, event.id, AGE, START + SOON)
    (told,) = messages(session)
    assert "was not measured" in told.sentences[0]
    assert told.picture_direction is None


def test_an_event_that_is_still_analysed_is_not_told(session: Session, of: Building) -> None:
    event = earthquake(session, of, START)
    event.state = "queued"
    tell_of_event(session, event.id, AGE, START + SOON)
    assert messages(session) == []


def raised(session: Session, of: Building, *found: Found, softer_by: float = 8.0) -> tuple[int, ...]:
    """Three earthquakes and what they show."""
    events = three_earthquakes(session, of)
    owned = [_owned(one, events) for one in (softer(softer_by), *found)]
    reconcile(session, of.id, owned, "events", START + 3 * DAY)
    session.flush()
    return events


def _owned(found: Found, events: tuple[int, ...]) -> Found:
    return replace(
        found,
        onset_event_id=events[0],
        raised_event_id=events[(found.raised_event_id or 1) - 1],
        event_ids=events[: len(found.event_ids)],
    )


def test_an_import_of_years_tells_of_its_alert_alone(session: Session, of: Building) -> None:
    events = raised(session, of)
    for _ in range(3):
        tell(session, of.id, AGE, START + 1000 * DAY)
    (told,) = messages(session)
    assert (told.key, told.kind, told.severity) == (f"event/{events[2]}", "alert", "alarm")
    assert told.subject.endswith(": The isolators are 8 % softer in direction x")
    assert "ought to be looked at" in " ".join(told.sentences)
    assert told.link == f"/alerts/{session.query(Alert).one().id}"


def test_alerts_of_one_earthquake_are_one_message(session: Session, of: Building) -> None:
    events = three_earthquakes(session, of)
    found = (softer(), softer(cause="damping/x", summary="The isolators damp 9 % less in direction x"))
    reconcile(session, of.id, [_owned(one, events) for one in found], "events", START + 3 * DAY)
    session.flush()
    tell(session, of.id, AGE, START + 1000 * DAY)
    (told,) = messages(session)
    assert told.subject.endswith("softer in direction x (and 1 more)")
    assert len(told.data["alerts"]) == 2
    assert told.link == f"/?building={of.code}"


def test_acknowledging_is_no_news_and_an_inspection_is(session: Session, of: Building) -> None:
    raised(session, of)
    alert, now = session.query(Alert).one(), START + 1000 * DAY
    tell(session, of.id, AGE, now)
    handling.acknowledge(session, alert, "Jo", "on my way", now)
    tell(session, of.id, AGE, now)
    assert len(messages(session)) == 1
    handling.inspect(session, alert, "Jo", "confirmed", "bearings 3 and 4 were replaced", None, now + DAY)
    for _ in range(2):
        tell(session, of.id, AGE, now + DAY)
    _, told = messages(session)
    assert (told.sequence, told.severity) == ("updated", "all_clear")
    assert "This is settled" in " ".join(told.sentences)
    assert "Jo: bearings 3 and 4 were replaced" in " ".join(told.sentences)


@pytest.mark.parametrize("how", ["data", "review"])
def test_an_alert_that_never_was_is_cancelled(session: Session, of: Building, how: str) -> None:
    events, now = raised(session, of), START + 1000 * DAY
    tell(session, of.id, AGE, now)
    if how == "data":
        analysed(session, session.get_one(Event, events[1]), now)
        reconcile(session, of.id, [], "events", now + SOON)
    else:
        handling.inspect(session, session.query(Alert).one(), "Jo", "unfounded", "a test load", None, now)
    session.flush()
    for _ in range(2):
        tell(session, of.id, AGE, now + SOON)
    _, told = messages(session)
    assert (told.sequence, told.severity) == ("cancelled", "all_clear")
    assert "This is cancelled, it never was so" in " ".join(told.sentences)


def test_what_a_sensor_may_explain_is_told_so(session: Session, of: Building) -> None:
    events = raised(session, of, gain(began_at=START + 2 * DAY, raised_event_id=3))
    tell(session, of.id, AGE, START + 1000 * DAY)
    (told,) = messages(session)
    assert told.key == f"event/{events[2]}"
    assert (told.kind, told.severity) == ("alert", "warning")
    assert "a sensor that took part measures wrongly" in " ".join(told.sentences)


def test_what_is_silenced_is_told_when_the_silence_ends(session: Session, of: Building) -> None:
    raised(session, of)
    now = START + 1000 * DAY
    handling.silence(session, of, "stiffness/*", now + DAY, "a load test", "Jo", now)
    tell(session, of.id, AGE, now)
    assert messages(session) == []
    tell(session, of.id, AGE, now + DAY)
    (told,) = messages(session)
    assert told.severity == "alarm"


def test_a_fresh_event_says_that_something_is_silenced(session: Session, of: Building) -> None:
    raised(session, of)
    now = START + 3 * DAY
    handling.silence(session, of, "stiffness/x", now + DAY, "a load test", "Jo", now)
    tell(session, of.id, AGE, now)
    told = messages(session)[-1]
    assert (told.kind, told.severity) == ("event", "note")
    assert "nothing unusual" not in told.subject + " ".join(told.sentences)
    assert "a load test" in " ".join(told.sentences)
    assert told.data["alerts"] == []


def test_a_later_event_names_what_still_stands_and_is_not_told_again_for_it(session: Session, of: Building) -> None:
    raised(session, of)
    later = earthquake(session, of, START + 10 * DAY)
    now = START + 10 * DAY + SOON
    tell_of_event(session, later.id, AGE, now)
    (told,) = messages(session)
    assert told.severity == "all_clear"
    assert "still stands, and waits for somebody: stiffness of the isolators, direction x." in told.sentences[-1]
    handling.inspect(session, session.query(Alert).one(), "Jo", "confirmed", "replaced", None, now + SOON)
    tell_of_event(session, later.id, AGE, now + SOON)
    assert len(messages(session)) == 1


def found_again(session: Session, of: Building, *found: Found) -> list[Message]:
    """What people are told once the rules find this; they were told of a loss with the third earthquake before."""
    now = START + 1000 * DAY
    tell(session, of.id, AGE, now)
    reconcile(session, of.id, found, "events", now)
    session.flush()
    for _ in range(2):
        tell(session, of.id, AGE, now)
    first, *then = messages(session)
    assert first.sequence == "new"
    return then


def of_events(found: Found, onset: int, raised: int, events: tuple[int, ...]) -> Found:
    """The same with other earthquakes, counted from 0."""
    return replace(
        found,
        began_at=START + onset * DAY,
        raised_at=START + raised * DAY,
        onset_event_id=events[onset],
        raised_event_id=events[raised],
        event_ids=events[onset : raised + 1],
    )


def test_an_alert_that_another_earthquake_turns_out_to_have_raised_is_not_told_again(
    session: Session, of: Building
) -> None:
    """As when events come late: it is the same loss, which began with the same earthquake."""
    events = raised(session, of)
    moved = of_events(softer(8.4), 0, 1, events)
    assert found_again(session, of, replace(moved, sentences=("They carry the building.",))) == []


@pytest.mark.parametrize(("onset", "percent"), [(1, 8.0), (0, 12.0)], ids=["it began later", "it is larger"])
def test_what_was_told_of_an_alert_is_updated_where_it_no_longer_holds(
    session: Session, of: Building, onset: int, percent: float
) -> None:
    events = raised(session, of)
    changed = softer(percent, sentences=("It is said in other words.",))
    (told,) = found_again(session, of, of_events(changed, onset, 1, events))
    assert (told.key, told.sequence, told.severity) == (f"event/{events[2]}", "updated", "alarm")
    assert f"{percent:.0f} % softer" in told.subject
    assert "in other words" in " ".join(told.sentences)
    assert told.data["alerts"][0]["began_at"] == (START + onset * DAY).isoformat()


def test_what_began_after_the_earthquake_it_was_told_with_is_told_anew(session: Session, of: Building) -> None:
    """A second loss, of which the series tells instead of the first."""
    events = raised(session, of)
    more = tuple(earthquake(session, of, START + number * DAY).id for number in (3, 4))
    then = found_again(session, of, of_events(softer(16.0), 3, 4, events + more))
    found = {one.key: (one.sequence, one.severity) for one in then}
    assert found == {f"event/{more[1]}": ("new", "alarm"), f"event/{events[2]}": ("updated", "all_clear")}
    assert "told with another earthquake now" in " ".join(next(one for one in then if one.number == 2).sentences)


def test_an_earthquake_that_comes_late_is_not_called_harmless(session: Session, of: Building) -> None:
    """It lies between the onset of a loss that was told and the earthquake that it was told with."""
    events, now = raised(session, of), START + 3 * DAY
    tell(session, of.id, timedelta(minutes=1), now)
    late = earthquake(session, of, START + DAY / 2)
    tell_of_event(session, late.id, AGE * 2, now + SOON)
    told = messages(session)[-1]
    assert told.key == f"event/{late.id}" != f"event/{events[2]}"
    assert "still stands, and waits for somebody: stiffness of the isolators, direction x." in told.sentences[-1]


def test_what_both_directions_turn_out_to_have_told_sooner_updates_what_was_told(
    session: Session, of: Building
) -> None:
    events = raised(session, of)
    both = replace(
        softer(), cause="stiffness/xy", summary="The isolators are 7 % softer in both directions", raised_at=START + DAY
    )
    alone = of_events(softer(), 0, 2, events)
    (told,) = found_again(session, of, alone, of_events(both, 0, 1, events))
    assert (told.key, told.sequence, told.severity) == (f"event/{events[2]}", "updated", "alarm")
    assert told.subject.endswith("The isolators are 7 % softer in both directions")
    assert "told with another earthquake" not in " ".join(told.sentences)


def test_what_each_direction_told_is_told_once_when_both_turn_out_to_tell_it(session: Session, of: Building) -> None:
    events = raised(session, of, softer(cause="stiffness/y", raised_at=START + DAY, raised_event_id=2))
    now = START + 1000 * DAY
    tell(session, of.id, AGE, now)
    assert [one.key for one in messages(session)] == [f"event/{events[1]}", f"event/{events[2]}"]
    x, y = (of_events(softer(cause=f"stiffness/{name}"), 0, at, events) for name, at in (("x", 2), ("y", 1)))
    reconcile(session, of.id, [x, y, replace(of_events(x, 0, 0, events), cause="stiffness/xy")], "events", now)
    session.flush()
    for _ in range(2):
        tell(session, of.id, AGE, now)
    found = {one.key: (one.sequence, one.severity) for one in messages(session)[2:]}
    assert found == {f"event/{events[1]}": ("updated", "alarm"), f"event/{events[2]}": ("updated", "all_clear")}
    last = next(one for one in messages(session)[2:] if one.severity == "all_clear")
    assert "told with another earthquake now" in " ".join(last.sentences)
    assert "nothing has to be done" not in " ".join(last.sentences)


def test_nothing_is_said_of_earthquakes_while_a_look_for_drift_waits(session: Session, of: Building) -> None:
    raised(session, of)
    job = jobs.enqueue_watch(session, of.id, None, START)
    tell(session, of.id, AGE, START + 1000 * DAY)
    assert messages(session) == []
    job.state = "failed"
    tell(session, of.id, AGE, START + 1000 * DAY)
    assert len(messages(session)) == 1


@pytest.mark.parametrize(("is_reference", "is_beyond"), [(False, False), (True, False), (False, True)])
def test_an_event_that_was_compared_is_told_without_reserve(
    session: Session, of: Building, is_reference: bool, is_beyond: bool
) -> None:
    event = earthquake(session, of, START)
    job = jobs.enqueue_watch(session, of.id, None, START)
    job.state = "done"
    value = DriftValue(
        event_id=event.id,
        value=0.0,
        std=0.01,
        count=5,
        is_reference=is_reference,
        is_beyond=is_beyond,
        is_inhibited=False,
        causes=[],
    )
    series = WatchedSeries(
        building_id=of.id, job_id=job.id, created_at=START, version="test", quantity="stiffness", subject="x", wanted=0
    )
    series.values.append(value)
    session.add(series)
    session.flush()
    tell_of_event(session, event.id, AGE, START + SOON)
    (told,) = messages(session)
    assert ("cannot be told" in " ".join(told.sentences)) == (is_reference or is_beyond)
