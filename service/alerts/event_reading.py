"""What the database knows of an event that people may be told."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import datetime
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.event_facts import AlertFacts, EventFacts
from service.alerts.silences import silence_of
from service.alerts.states import CLOSED, PENDING
from service.alerts.tables import Alert, Silence
from service.alerts.telling import Telling, as_told, tellings, told_with
from service.analyses import queries as analysis_queries
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.records.tables import Event
from service.verdict import reading

GRAVITY = ("limit", "deterioration", "sensor", "model", "recovery", "data")
"""Kinds of alerts, the gravest first."""


def event_facts(
    session: Session,
    event: Event,
    told: Collection[int],
    first_told_at: datetime,
    now: datetime,
    as_of: datetime | None = None,
) -> EventFacts:
    """What people may be told of an event.

    Args:
        session: to read with.
        event: one that was analysed, refused, or failed.
        told: numbers of the alerts that people were told of with it before.
        first_told_at: when they were told of it first; `now` if they were not.
        now: aware time.
        as_of: the verdict counts the alerts that were open at that time; None: those that are open now.
    """
    building = session.get_one(Building, event.building_id)
    zone = ZoneInfo(building_store.described(session, building).timezone)
    current = Analysis.event_id == event.id, Analysis.current, Analysis.refusal.is_(None)
    analysis = session.scalars(select(Analysis).where(*current)).one_or_none() if event.state == "analysed" else None
    results = analysis_queries.direction_results(session, analysis.id) if analysis else ()
    layer = analysis_queries.layer_result(session, analysis.id) if analysis else None
    silences = queries.silences(session, building.id)
    before = tellings(session, building.id)
    here = [(one, at) for one, at in _told_here(session, event, before) if _is_told_of(one, told)]
    moved = [one for one in queries.of_numbers(session, told) if told_with(session, one, before).event_id != event.id]
    return EventFacts(
        id=event.id,
        building_id=building.id,
        code=building.code,
        name=building.name,
        start=event.start.astimezone(zone),
        end=event.end.astimezone(zone),
        refusal=None if analysis else (event.reason or "no reason was noted").rstrip("."),
        pga=analysis.pga if analysis else None,
        displacements={one.direction: one.peak_displacement for one in results if one.peak_displacement is not None},
        resultant=layer.peak_resultant if layer else None,
        residuals={
            one.direction: (one.residual_displacement, one.residual_displacement_std)
            for one in results
            if one.residual_displacement is not None
        },
        forces={one.direction: one.peak_force for one in results},
        assessment=reading.of_event(session, event, as_of),
        alerts=tuple(sorted((as_told(alert_facts(one, silences, zone, now), at) for one, at in here), key=gravity)),
        moved=tuple(alert_facts(one, silences, zone, now) for one in moved),
    )


def alert_facts(alert: Alert, silences: Sequence[Silence], zone: ZoneInfo, now: datetime) -> AlertFacts:
    """An alert as people may be told of it."""
    silence = silence_of(alert, silences, now)
    return AlertFacts(
        id=alert.id,
        cause=alert.cause,
        kind=alert.kind,
        state=alert.state,
        summary=alert.summary,
        sentences=tuple(alert.sentences),
        evidence=alert.evidence,
        began_at=alert.began_at,
        changed_after=alert.changed_after,
        changed_by=alert.changed_by,
        end=_end(alert) if alert.state in CLOSED else "",
        silenced_until=silence.ends_at.astimezone(zone) if silence else None,
        silence_reason=silence.reason.rstrip(".") if silence else "",
    )


def gravity(alert: AlertFacts) -> tuple[int, int]:
    """By which alerts are told, the gravest first."""
    return GRAVITY.index(alert.kind), alert.id


def _told_here(session: Session, event: Event, before: Mapping[int, Telling]) -> Iterator[tuple[Alert, Telling]]:
    """Alerts of which people are told with an event."""
    numbers = [number for number, at in before.items() if at.event_id == event.id]
    for one in queries.of_event(session, event.id, numbers):
        at = told_with(session, one, before)
        if at.event_id == event.id:
            yield one, at


def _is_told_of(alert: Alert, told: Collection[int]) -> bool:
    return alert.state != PENDING and (alert.state not in CLOSED or alert.id in told)


def _end(alert: Alert) -> str:
    """Why it ended, and who said so."""
    last = alert.changes[-1]
    return last.note if last.by is None else f"{last.by}: {last.note}"
