"""What are people told of an alert that no earthquake raised, and when?"""

from collections.abc import Mapping
from datetime import UTC, datetime
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from service.alerts import event_notice, queries
from service.alerts.event_facts import AlertFacts
from service.alerts.event_reading import alert_facts
from service.alerts.tables import Alert
from service.alerts.telling import Telling, told_with
from service.alerts.words import of_cause, of_time
from service.buildings import store as building_store
from service.notify import outbox
from service.notify.notice import Notice


def tell_of_alert(session: Session, alert: Alert, now: datetime) -> None:
    """Tell people that an alert is active, and when it is over; one that was over before they were told is not told."""
    zone = ZoneInfo(building_store.described(session, alert.building).timezone)
    facts = alert_facts(alert, queries.silences(session, alert.building_id), zone, now)
    was_told = bool(queries.messages(session, alert.building_id, key(alert.id)))
    if facts.is_news or (facts.has_ended and was_told):
        outbox.put(session, alert_notice(alert, facts, was_told, zone), now)


def key(alert_id: int) -> str:
    """Under which messages about an alert that no earthquake raised follow each other."""
    return f"alert/{alert_id}"


def thread(session: Session, alert: Alert, told: Mapping[int, Telling]) -> str:
    """Under which messages people are told of an alert: those of an earthquake, or its own."""
    if alert.raised_event_id is None:
        return key(alert.id)
    return event_notice.key(told_with(session, alert, told).event_id)


def alert_notice(alert: Alert, facts: AlertFacts, was_told: bool, zone: ZoneInfo) -> Notice:
    """What there is to tell of an alert that no earthquake raised."""
    over = facts.has_ended
    since = of_time(alert.began_at.astimezone(zone))
    sentences = (
        (f"This is over: {facts.summary}, since {since}. {facts.end}",)
        if over
        else (f"{facts.summary}, since {since}.", *facts.sentences)
    )
    return Notice(
        key=key(alert.id),
        building_id=alert.building_id,
        kind="data" if alert.kind == "data" else "alert",
        sequence="cancelled" if facts.state == "withdrawn" else "updated" if was_told else "new",
        severity="note" if over else "warning",
        has_ended=over,
        subject=f"Over: {facts.summary}" if over else facts.summary,
        sentences=sentences,
        facts=(("Since", f"{alert.began_at.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"), ("About", of_cause(alert.cause))),
        link=f"/alerts/{alert.id}",
        data={
            "building": alert.building.code,
            "alert": alert.id,
            "cause": alert.cause,
            "state": alert.state,
            "since": alert.began_at.astimezone(UTC).isoformat(),
            "evidence": dict(alert.evidence),
        },
    )
