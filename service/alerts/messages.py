"""The rules of when a message is written: about earthquakes and alerts, to new recipients, and as a reminder."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.early_messages import is_early
from service.alerts.lifecycle import ACTIVE, PENDING
from service.alerts.message_content import (
    REMINDER_KEY,
    Earlier,
    Unacknowledged,
    alert_content,
    event_content,
    reminder_content,
)
from service.alerts.message_facts import (
    GRAVITY,
    ReportedEvent,
    alert_facts,
    alert_key,
    event_facts,
    event_key,
    gravity,
    message_key,
    reports_by_alert,
    silence_of,
)
from service.alerts.tables import Alert
from service.buildings import recipients, store as building_store
from service.buildings.tables import Building
from service.jobs import queue as job_queue
from service.notify import outbox
from service.notify.outbox import MessageContent
from service.notify.tables import Message, Receiver
from service.records.tables import Event
from service.verdict import levels

FINAL = ("analysed", "refused", "failed")
"""States of events without further work under way."""
REPEATING = "alertmanager"
"""Kind of recipients that repeat messages themselves."""
REMINDERS_APART = timedelta(days=1)
"""Shortest time between two reminders of one building."""


@dataclass(frozen=True, slots=True)
class Reminder:
    """A reminder of a building's unacknowledged alerts."""

    due_at: datetime
    content: MessageContent
    recipients: Sequence[Receiver]


def write_messages(session: Session, building_id: int, max_age: timedelta, now: datetime) -> None:
    """Put everything new about a building into the outbox, and store its level; repeating it writes nothing else.

    While the building's earthquakes are being compared, no message about them is written: the comparison ends with
    this call.

    Args:
        session: of the transaction that stores the news and has locked the building.
        building_id: of the building.
        max_age: of an earthquake without alerts, settings.notify.max_event_age.
        now: aware time.
    """
    if not job_queue.is_monitoring_pending(session, building_id):
        for event in _events_with_news(session, building_id, max_age, now):
            write_event_message(session, event.id, max_age, now)
    for alert in queries.alerts_without_event(session, building_id):
        _write_alert_message(session, alert, now)
    session.flush()
    send_open_alerts_to_new_recipients(session, building_id, now)
    levels.store(session, [building_id], now)


def write_event_message(session: Session, event_id: int, max_age: timedelta, now: datetime) -> None:
    """Put a message about an event into the outbox, unless the last one says the same.

    An alert about another earthquake that opens or ends later is no news of this one; a message that is written for
    another reason counts it all the same. An event that ended longer ago than `max_age` has a message only if it raised
    an alert, so that importing the records of years sends no other messages.
    """
    event = session.get_one(Event, event_id)
    if event.state not in FINAL:
        return
    messages = queries.messages(session, event.building_id, event_key(event_id))
    earlier, building = _earlier(messages), session.get_one(Building, event.building_id)
    as_of = (None, _first_report(messages, now))
    both = [ReportedEvent(event, earlier.alerts, one) for one in as_of]
    facts, as_of_first = event_facts(session, building, both, now)
    has_alert = earlier.alerts or any(one.is_reported or one.is_on_hold for one in facts.alerts)
    if has_alert or event.end >= now - max_age:
        content = replace(event_content(facts, earlier), news=event_content(as_of_first, earlier))
        outbox.put(session, content, now)


def send_open_alerts_to_new_recipients(session: Session, building_id: int, now: datetime) -> None:
    """Send the last message of each alert that is active, acknowledged or on hold to recipients added since.

    Repeating it changes nothing: each message goes to each recipient once.
    """
    keys = sorted(set(_open_keys(session, building_id, now)))
    last = [messages[-1] for key in keys if (messages := queries.messages(session, building_id, key))]
    if last:
        outbox.forward(session, building_id, last, now)


def remind(session: Session, building_id: int, interval: timedelta, now: datetime) -> None:
    """Put a reminder of all unacknowledged alerts of a building into the outbox, if one is due.

    Args:
        session: of a transaction that has locked the building.
        building_id: of the building.
        interval: between reminders of an alert; zero: none.
        now: aware time.
    """
    reminder = next_reminder(session, building_id, interval, now)
    if reminder is not None and reminder.due_at <= now:
        outbox.put_for(session, reminder.content, reminder.recipients, now)


def next_reminder(session: Session, building_id: int, interval: timedelta, now: datetime) -> Reminder | None:
    """The next reminder of a building, as its alerts are now; None if there is nothing or no one to remind."""
    if not interval or all(one.state != ACTIVE for one in queries.open_alerts(session, building_id, GRAVITY)):
        return None
    building = session.get_one(Building, building_id)
    zone = ZoneInfo(building_store.described(session, building).timezone)
    unacknowledged = sorted(_unacknowledged(session, building_id, zone, now), key=lambda one: gravity(one[1].facts))
    before = queries.messages(session, building_id, REMINDER_KEY)
    alerts = [one for _, one in unacknowledged]
    due_at = reminder_due_at(alerts, before[-1].created_at if before else None, interval)
    reached = queries.recipients_of(session, building_id, {key for key, _ in unacknowledged})
    every = recipients.of_building(session, building_id)
    again = [one for one in every if one.id in reached and one.kind != REPEATING]
    if due_at is None or not again:
        return None
    period = max(interval, REMINDERS_APART)
    return Reminder(due_at, reminder_content(building_id, building.code, building.name, zone, alerts, period), again)


def reminder_due_at(alerts: Sequence[Unacknowledged], last: datetime | None, interval: timedelta) -> datetime | None:
    """Time at which the next reminder is due; None without an alert.

    Args:
        alerts: of one building.
        last: time of the building's last reminder; None: there was none.
        interval: between reminders of an alert.
    """
    if not alerts:
        return None
    reported = min(one.reported_at for one in alerts)
    return reported + interval if last is None else max(max(reported, last) + interval, last + REMINDERS_APART)


def _write_alert_message(session: Session, alert: Alert, now: datetime) -> None:
    """Report that an alert is active, and its end; an alert that ended before its first message is not reported."""
    zone = ZoneInfo(building_store.described(session, alert.building).timezone)
    facts = alert_facts(alert, queries.silences(session, alert.building_id), zone, now)
    was_reported = bool(queries.messages(session, alert.building_id, alert_key(alert.id)))
    if facts.is_reported or (facts.has_ended and was_reported):
        outbox.put(session, alert_content(alert, facts, was_reported, zone), now)


def _events_with_news(session: Session, building_id: int, max_age: timedelta, now: datetime) -> list[Event]:
    """Events whose message is the first or differs from the last one, the earliest first.

    All are compared by as many statements as one takes: an event with a message may change long after its alerts have
    ended, by a new analysis, a late earthquake before it, another baseline or another limit, and most never do. A
    message about one event does not change what another one's says.
    """
    building = session.get_one(Building, building_id)
    events = [one for one in queries.events_to_report(session, building_id, now - max_age) if one.state in FINAL]
    messages = queries.messages_by_key(session, building_id, [event_key(one.id) for one in events])
    before = {one.id: messages[key] for one in events if (key := event_key(one.id)) in messages}
    earlier = {number: _earlier(of_event) for number, of_event in before.items()}
    reported = [
        ReportedEvent(one, earlier[one.id].alerts, _first_report(before[one.id], now))
        for one in events
        if one.id in before
    ]
    unchanged = {
        one.id
        for one in (event_facts(session, building, reported, now) if reported else ())
        if not outbox.is_news(event_content(one, earlier[one.id]), before[one.id][-1])
    }
    return [one for one in events if one.id not in unchanged]


def _first_report(messages: Sequence[Message], now: datetime) -> datetime:
    """Time of an event's first message about its results, of which later ones are updates; now if there is none."""
    return next((one.created_at for one in messages if not is_early(one)), now)


def _earlier(messages: Sequence[Message]) -> Earlier:
    return Earlier(
        is_empty=not messages,
        had_results=any(message.data["refusal"] is None and not is_early(message) for message in messages),
        alerts=frozenset(one["id"] for message in messages for one in message.data["alerts"]),
    )


def _open_keys(session: Session, building_id: int, now: datetime) -> Iterator[str]:
    """Keys of the messages that reported open alerts, except silenced ones."""
    open_alerts = [one for one in queries.open_alerts(session, building_id, GRAVITY) if one.state != PENDING]
    if not open_alerts:
        return
    reports, silences = reports_by_alert(session, building_id), queries.silences(session, building_id)
    for one in open_alerts:
        if (one.raised_event_id is None or one.id in reports) and silence_of(one, silences, now) is None:
            yield message_key(session, one, reports)


def _unacknowledged(
    session: Session, building_id: int, zone: ZoneInfo, now: datetime
) -> Iterator[tuple[str, Unacknowledged]]:
    """Each with the key of the messages that reported it, except silenced ones."""
    reports, silences = reports_by_alert(session, building_id), queries.silences(session, building_id)
    for one in queries.open_alerts(session, building_id, GRAVITY):
        key, facts = message_key(session, one, reports), alert_facts(one, silences, zone, now)
        messages = queries.messages(session, building_id, key)
        was_reported = bool(messages) and (one.raised_event_id is None or one.id in reports)
        if one.state == ACTIVE and one.activated_at is not None and facts.is_reported and was_reported:
            reported_at = messages[-1].created_at
            yield key, Unacknowledged(facts=facts, activated_at=one.activated_at, reported_at=reported_at)
