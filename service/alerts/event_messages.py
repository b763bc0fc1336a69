"""When are people told of an earthquake, and when again?"""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.alert_messages import tell_of_alert
from service.alerts.event_notice import Before, event_notice, key
from service.alerts.event_reading import event_facts
from service.alerts.newcomers import tell_newcomers
from service.jobs import queue as job_queue
from service.notify import outbox
from service.notify.tables import Message
from service.records.tables import Event

ENDED = ("analysed", "refused", "failed")
"""States of events of which nothing more is under way."""


def tell(session: Session, building_id: int, message_age: timedelta, now: datetime) -> None:
    """Tell people everything that is new of a building; what was said already is not said again.

    While a look for drift is under way nothing is said of earthquakes: it ends with telling what it found.
    """
    if not job_queue.is_being_watched(session, building_id):
        for event_id in queries.events_to_tell(session, building_id, now - message_age):
            tell_of_event(session, event_id, message_age, now)
    for alert in queries.alerts_without_event(session, building_id):
        tell_of_alert(session, alert, now)
    session.flush()
    tell_newcomers(session, building_id, now)


def tell_of_event(session: Session, event_id: int, message_age: timedelta, now: datetime) -> None:
    """Tell people of an event what is known now, unless that was said already.

    An alert that opens or ends later, and is about another earthquake, is no news of this one; a message that is sent
    for another reason counts it all the same.

    An event that ended longer ago than `message_age` is told of only where it raised an alert, so that an import of
    years is silent but for those.

    Args:
        session: of the transaction in which what is told is stored.
        event_id: of the event.
        message_age: settings.notify.max_event_age.
        now: aware time.
    """
    event = session.get_one(Event, event_id)
    if event.state not in ENDED:
        return
    messages = queries.messages(session, event.building_id, key(event_id))
    before = _before(messages)
    first = messages[0].created_at if messages else now
    facts = event_facts(session, event, before.alerts, first, now)
    has_alert = before.alerts or any(one.is_news or one.is_held_back for one in facts.alerts)
    if has_alert or event.end >= now - message_age:
        then = event_facts(session, event, before.alerts, first, now, as_of=first)
        outbox.put(session, replace(event_notice(facts, before), news=event_notice(then, before)), now)


def _before(messages: Sequence[Message]) -> Before:
    return Before(
        is_nothing=not messages,
        gave_result=any(message.data["refusal"] is None for message in messages),
        alerts=frozenset(one["id"] for message in messages for one in message.data["alerts"]),
    )
