"""With which earthquake's message are people told of an alert, and in which words?

With the one that told of it first, though it turn out later that another earthquake raised it: what arrives late, or in
another order, tells nobody the same again as if it were new. The words stay too, until what they say no longer holds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.acts import differs
from service.alerts.event_facts import AlertFacts
from service.alerts.tables import Alert
from service.records.tables import Event


@dataclass(frozen=True, slots=True)
class Telling:
    """The earthquake whose message tells of an alert."""

    event_id: int
    start: datetime
    said: Mapping[str, Any] | None
    """What the message said of the alert, as its data have it; None where it said nothing of it by itself."""


def tellings(session: Session, building_id: int) -> dict[int, Telling]:
    """By alert: the last message about an earthquake that told of it."""
    found: dict[int, Telling] = {}
    for message in queries.messages_of_alerts(session, building_id):
        start = datetime.fromisoformat(message.data["start"])
        for said in message.data["alerts"]:
            found[said["id"]] = Telling(message.data["event"], start, said)
    return found


def told_with(session: Session, alert: Alert, told: Mapping[int, Telling]) -> Telling:
    """Where people are told of an alert that an event raised; what began after that earthquake is another change."""
    before = told.get(alert.id)
    if before is not None and not _began_after(alert, before.start):
        return before
    event = session.get_one(Event, alert.raised_event_id)
    return Telling(event.id, event.start, None)


def as_told(facts: AlertFacts, telling: Telling) -> AlertFacts:
    """In the words that people were told, as long as these hold."""
    said = telling.said
    if said is None or datetime.fromisoformat(said["began_at"]) != facts.began_at:
        return facts
    if differs(said["evidence"], facts.evidence):
        return facts
    return replace(facts, summary=said["summary"], sentences=tuple(said["sentences"]), evidence=said["evidence"])


def _began_after(alert: Alert, start: datetime) -> bool:
    """Whether it surely began after the earthquake of that start, which did not show it."""
    return alert.began_at > start and (alert.changed_after is None or alert.changed_after >= start)
