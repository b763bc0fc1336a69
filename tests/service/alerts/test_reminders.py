"""Reminders of unacknowledged alerts go at intervals to those who received the alert."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from alert_candidates import DAY, START, gain_error, softer_isolators, stopped_data
from alert_fixtures import building, three_earthquakes
from hypothesis import given, strategies as st
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.message_content import Unacknowledged, reminder_content
from service.alerts.message_facts import AlertFacts
from service.alerts.messages import REMINDERS_APART, remind, reminder_due_at, write_messages
from service.alerts.periodic_checks import check_buildings
from service.alerts.reconciliation import reconcile
from service.alerts.schema import alert_out
from service.alerts.tables import Alert
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building
from service.notify.tables import Message
from service.settings import Settings

NOW = START + 1000 * DAY
WEEK = timedelta(days=7)
AGE = timedelta(days=2)
SETTINGS = Settings(disk_reserve=0)


def untaken(reported_at: datetime, **differently: object) -> Unacknowledged:
    about = {"id": 5, "cause": "stiffness", "kind": "deterioration", "state": "active", "summary": "It is softer"}
    facts = AlertFacts(**about | {"sentences": (), "evidence": {}, "began_at": START} | differently)
    return Unacknowledged(facts=facts, activated_at=START, reported_at=reported_at)


def is_due(waiting: list[Unacknowledged], last: datetime | None, interval: timedelta, now: datetime) -> bool:
    due_at = reminder_due_at(waiting, last, interval)
    return due_at is not None and due_at <= now


@pytest.mark.parametrize(
    ("reported", "last", "due"),
    [
        ([7.0], None, True),
        ([6.9], None, False),
        ([6.9, 7.0], None, True),
        ([20.0], 7.0, True),
        ([20.0], 6.9, False),
        ([7.0, 20.0], 0.9, False),
        ([3.0], 20.0, False),
        ([], 20.0, False),
        ([], None, False),
    ],
)
def test_when_a_reminder_is_due(reported: list[float], last: float | None, due: bool) -> None:
    """By the days since each alert was reported, and since the last reminder."""
    waiting = [untaken(NOW - days * DAY) for days in reported]
    assert is_due(waiting, None if last is None else NOW - last * DAY, WEEK, NOW) is due


@given(
    reported=st.lists(st.floats(0, 40), min_size=1, max_size=4),
    interval=st.floats(0.01, 15),
    looks=st.lists(st.floats(0, 60), max_size=40),
)
def test_reminders_are_never_closer_than_a_day_and_none_is_forgotten(
    reported: list[float], interval: float, looks: list[float]
) -> None:
    """At any time of a check: after the interval and a day without a reminder there is one."""
    waiting, every, sent = [untaken(START + days * DAY) for days in reported], timedelta(days=interval), [START]
    for now in (START + max(40.0, days) * DAY for days in sorted(looks)):
        if is_due(waiting, sent[-1], every, now):
            assert now - sent[-1] >= REMINDERS_APART
            sent.append(now)
        else:
            assert now - sent[-1] < REMINDERS_APART or all(
                now - max(one.reported_at, sent[-1]) < every for one in waiting
            )


def test_a_reminder_names_the_alert_its_age_and_what_to_do() -> None:
    waiting = [untaken(START), untaken(START, id=6, cause="source", kind="data", summary="The server is silent")]
    printed = reminder_content(1, "TOWER", "A tower", ZoneInfo("Asia/Tokyo"), waiting, WEEK)
    assert (printed.sequence, printed.kind, printed.severity, printed.is_over) == ("repeat", "alert", "alarm", False)
    assert printed.subject == "Not acknowledged yet: It is softer (and 1 more)"
    assert printed.sentences[1] == "It is softer. It has been active since 1 January 2024, 09:00 (JST)."
    words = " ".join(printed.sentences)
    assert "reminder" in printed.sentences[0]
    assert "The server is silent" in words
    assert "To acknowledge an alert, open its page" in words
    assert "every 7 days" in words
    assert printed.link == "/buildings/TOWER/alerts"
    assert reminder_content(1, "TOWER", "A tower", ZoneInfo("UTC"), waiting[:1], WEEK).link == "/alerts/5"
    assert reminder_content(1, "TOWER", "A tower", ZoneInfo("UTC"), waiting[1:], WEEK).kind == "data"


@pytest.fixture
def of(sessions: sessionmaker[Session]) -> Iterator[Building]:
    """It lost stiffness, and a sensor reads too much; both were reported at NOW."""
    with sessions.begin() as session:
        made = building(session)
        for name, kind, address, kinds in (
            ("manager", "email", "manager@example.org", WANTED_KINDS),
            ("pager", "alertmanager", "https://alerts.example.org", ("alert", "data")),
            ("neighbour", "email", "neighbour@example.org", ("drill",)),
        ):
            recipients.add(session, made.id, ReceiverRule(name, kind, address, None, kinds, SEVERITIES), "Jo", START)
        events = three_earthquakes(session, made)
        owned = {"onset_event_id": events[0], "raised_event_id": events[2], "event_ids": events}
        found = [replace(softer_isolators(), **owned), replace(gain_error("XX.DEMO.05.HNX"), **owned)]
        reconcile(session, made.id, found, "events", NOW)
        session.flush()
        write_messages(session, made.id, AGE, NOW)
    return made


def looked(sessions: sessionmaker[Session], settings: Settings, *days: float) -> list[Message]:
    """The reminders, after checks a number of days after the report."""
    for one in days:
        check_buildings(sessions, settings, NOW + one * DAY)
    with sessions() as session:
        found = session.query(Message).filter_by(sequence="repeat").order_by(Message.id).all()
        for message in found:
            assert [one.receiver.name for one in message.deliveries] == ["manager"]
        return found


def test_recipients_are_reminded_every_week_until_someone_acknowledges(
    sessions: sessionmaker[Session], of: Building
) -> None:
    assert looked(sessions, SETTINGS, 0, 1, 6.9) == []
    (first,) = looked(sessions, SETTINGS, 7, 7.1, 13.9)
    assert (first.kind, first.severity, first.number) == ("alert", "alarm", 1)
    assert [one["cause"] for one in first.data["alerts"]] == ["stiffness", "gain/XX.DEMO.05.HNX"]
    with sessions.begin() as session:
        alert = session.query(Alert).filter_by(cause="stiffness").one()
        operator_actions.acknowledge(session, alert, "Jo", "on my way", NOW + 13.9 * DAY)
    _, second = looked(sessions, SETTINGS, 14, 15)
    assert [one["cause"] for one in second.data["alerts"]] == ["gain/XX.DEMO.05.HNX"]
    assert second.severity == "warning"
    with sessions.begin() as session:
        alert = session.query(Alert).filter_by(kind="sensor").one()
        operator_actions.inspect(session, alert, "Jo", "confirmed", "replaced", None, NOW + 20 * DAY)
    assert len(looked(sessions, SETTINGS, 30, 60)) == 2
    with sessions() as session:
        orders = {
            alert.kind: [one.sequence for one in alert_out(session, alert, NOW).messages if one.receiver == "manager"]
            for alert in session.query(Alert)
        }
    assert orders["deterioration"].count("repeat") == 1
    assert orders["sensor"].count("repeat") == 2


def test_what_is_silenced_waits_and_no_one_is_reminded_where_that_is_off(
    sessions: sessionmaker[Session], of: Building
) -> None:
    with sessions.begin() as session:
        here = session.get_one(Building, of.id)
        operator_actions.silence(session, here, "*", NOW + 20 * DAY, "under repair", "Jo", NOW + DAY)
    assert looked(sessions, SETTINGS, 8, 16, 19.9) == []
    assert looked(sessions, Settings(disk_reserve=0, reminder_interval=0), 20, 30) == []
    assert len(looked(sessions, SETTINGS, 30.1)) == 1


def test_what_holds_an_alert_back_holds_its_reminder_back(sessions: sessionmaker[Session], of: Building) -> None:
    with sessions.begin() as session:
        events = session.query(Alert).filter_by(cause="stiffness").one().event_ids
        owned = {"onset_event_id": events[0], "raised_event_id": events[2], "event_ids": tuple(events)}
        reconcile(
            session, of.id, [replace(one, **owned) for one in (softer_isolators(), gain_error())], "events", NOW + DAY
        )
    (reported,) = looked(sessions, SETTINGS, 1, 9)
    assert "stiffness" not in [one["cause"] for one in reported.data["alerts"]]


def test_data_that_stopped_are_reminded_of_too(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        made = building(session)
        rule = ReceiverRule("manager", "email", "m@example.org", None, WANTED_KINDS, SEVERITIES)
        recipients.add(session, made.id, rule, "Jo", START)
        reconcile(session, made.id, [stopped_data()], "clock", NOW)
        session.flush()
        for days in (0, 6, 7, 8):
            write_messages(session, made.id, AGE, NOW + days * DAY)
            remind(session, made.id, WEEK, NOW + days * DAY)
        reported = [(one.kind, one.sequence, one.created_at) for one in session.query(Message).order_by(Message.id)]
    assert reported == [("data", "new", NOW), ("data", "repeat", NOW + WEEK)]
