"""Messages about an alert that later analyses change: another earthquake, a larger change, an earlier beginning."""

from dataclasses import replace

import pytest
from alert_candidates import DAY, START, softer_isolators
from alert_fixtures import AGE, earthquake, messages, raise_softening, with_events
from sqlalchemy.orm import Session

from service.alerts.candidates import AlertCandidate
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.buildings.tables import Building
from service.notify.tables import Message


def found_again(session: Session, of: Building, *found: AlertCandidate) -> list[Message]:
    """Messages once the rules report this, after a loss was reported with the third earthquake."""
    now = START + 1000 * DAY
    write_messages(session, of.id, AGE, now)
    reconcile(session, of.id, found, "events", now)
    session.flush()
    for _ in range(2):
        write_messages(session, of.id, AGE, now)
    first, *then = messages(session)
    assert first.sequence == "new"
    return then


def test_an_alert_that_another_earthquake_turns_out_to_have_raised_is_not_reported_again(
    session: Session, of: Building
) -> None:
    """As when events come late: it is the same loss, which began with the same earthquake."""
    events = raise_softening(session, of)
    moved = with_events(softer_isolators(8.4), 0, 1, events)
    assert found_again(session, of, replace(moved, sentences=("They carry the building.",))) == []


@pytest.mark.parametrize(("onset", "percent"), [(1, 8.0), (0, 12.0)], ids=["it began later", "it is larger"])
def test_what_was_reported_with_an_alert_is_updated_where_it_no_longer_holds(
    session: Session, of: Building, onset: int, percent: float
) -> None:
    events = raise_softening(session, of)
    changed = softer_isolators(percent, sentences=("It is said in other words.",))
    (reported,) = found_again(session, of, with_events(changed, onset, 1, events))
    assert (reported.key, reported.sequence, reported.severity) == (f"event/{events[2]}", "updated", "alarm")
    assert f"{percent:.0f} % softer" in reported.subject
    assert "in other words" in " ".join(reported.sentences)
    assert reported.data["alerts"][0]["began_at"] == (START + onset * DAY).isoformat()


def test_what_began_after_the_earthquake_it_was_reported_with_is_reported_anew(session: Session, of: Building) -> None:
    """A second loss, which the series shows instead of the first."""
    events = raise_softening(session, of)
    more = tuple(earthquake(session, of, START + number * DAY).id for number in (3, 4))
    then = found_again(session, of, with_events(softer_isolators(16.0), 3, 4, events + more))
    found = {one.key: (one.sequence, one.severity) for one in then}
    assert found == {f"event/{more[1]}": ("new", "alarm"), f"event/{events[2]}": ("updated", "note")}
    assert "Later results link this to another earthquake, with which it is now reported" in " ".join(
        next(one for one in then if one.number == 2).sentences
    )


def test_a_direction_that_shows_it_too_updates_what_was_reported(session: Session, of: Building) -> None:
    """One alert, in the one thread of messages; not a second alert that holds the first back."""
    events = raise_softening(session, of)
    both = softer_isolators(
        7.8, cause="stiffness/xy", summary="The isolators are 7.8 % softer in both directions", raised_at=START + DAY
    )
    (reported,) = found_again(
        session, of, with_events(softer_isolators(), 0, 2, events), with_events(both, 0, 1, events)
    )
    assert (reported.key, reported.sequence, reported.severity) == (f"event/{events[2]}", "updated", "alarm")
    assert reported.subject.endswith("The isolators are 7.8 % softer in both directions")
    assert "The isolators are 8 % softer in direction x." in " ".join(reported.sentences)
    assert "another earthquake, with which it is now reported" not in " ".join(reported.sentences)
    (alert,) = reported.data["alerts"]
    assert [one["subject"] for one in alert["evidence"]["parts"]] == ["x", "xy"]


def test_a_loss_that_surely_began_later_in_another_direction_is_reported_anew(session: Session, of: Building) -> None:
    events = raise_softening(session, of)
    more = tuple(earthquake(session, of, START + number * DAY).id for number in (3, 4))
    y = with_events(softer_isolators(6.0, cause="stiffness/y", summary="6 % softer in y"), 3, 4, events + more)
    y = replace(y, changed_after=START + 2 * DAY, changed_by=START + 3 * DAY)
    then = found_again(session, of, with_events(softer_isolators(), 0, 2, events + more), y)
    news = next(one for one in then if one.sequence == "new")
    assert (news.key, news.severity) == (f"event/{more[1]}", "alarm")
    assert "6 % softer in y, besides an earlier change in direction x" in news.subject
