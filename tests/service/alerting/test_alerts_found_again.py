"""What people are told of an alert when later analyses find it otherwise: with another earthquake, larger, sooner."""

from dataclasses import replace

import pytest
from alarmed import AGE, earthquake, messages, of_events, raised
from findings import DAY, START, softer
from sqlalchemy.orm import Session

from service.alerting.event_messages import tell
from service.alerting.found import Found
from service.alerting.reconciling import reconcile
from service.database import Building, Message


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
