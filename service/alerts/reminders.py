"""Who is reminded of a building's alerts that nobody has taken on? Those who were told of them."""

from collections.abc import Iterator
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from service.alerts import alert_messages, queries, reminding
from service.alerts.event_reading import GRAVITY, alert_facts, gravity
from service.alerts.reminding import Untaken
from service.alerts.states import ACTIVE
from service.alerts.telling import tellings
from service.buildings import recipients, store as building_store
from service.buildings.tables import Building
from service.notify import outbox

REPEATING = "alertmanager"
"""Kind of receivers that themselves repeat what they were told."""


def remind(session: Session, building_id: int, interval: timedelta, now: datetime) -> None:
    """Tell those who were told again, of all alerts of a building that nobody has taken on, where that is due.

    Args:
        session: of a transaction.
        building_id: of the building.
        interval: after which people are reminded of an alert; none: never.
        now: aware time.
    """
    if not interval:
        return
    building = session.get_one(Building, building_id, with_for_update=True)
    zone = ZoneInfo(building_store.described(session, building).timezone)
    found = sorted(_untaken(session, building_id, zone, now), key=lambda one: gravity(one[1].facts))
    before = queries.messages(session, building_id, reminding.KEY)
    untaken = [one for _, one in found]
    if reminding.is_due(untaken, before[-1].created_at if before else None, interval, now):
        told = queries.receivers_told(session, building_id, {key for key, _ in found})
        every = recipients.of_building(session, building_id)
        if again := [one for one in every if one.id in told and one.kind != REPEATING]:
            notice = reminding.reminder(building_id, building.code, building.name, zone, untaken, interval)
            outbox.put_for(session, notice, again, now)


def _untaken(session: Session, building_id: int, zone: ZoneInfo, now: datetime) -> Iterator[tuple[str, Untaken]]:
    """Each with the key of the messages that told of it; what is silenced waits."""
    told, silences = tellings(session, building_id), queries.silences(session, building_id)
    for one in queries.open_alerts(session, building_id, GRAVITY):
        key, facts = alert_messages.thread(session, one, told), alert_facts(one, silences, zone, now)
        messages = queries.messages(session, building_id, key)
        was_told = bool(messages) and (one.raised_event_id is None or one.id in told)
        if one.state == ACTIVE and one.activated_at is not None and facts.is_news and was_told:
            yield key, Untaken(facts=facts, activated_at=one.activated_at, told_at=messages[-1].created_at)
