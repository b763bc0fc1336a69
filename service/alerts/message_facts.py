"""The facts that messages report about an earthquake and its alerts, read from the database.

An alert is reported with one earthquake. The first message about it decides which one, even if later results show that
another earthquake raised it: late or reordered results do not repeat an alert as if it were new. Its wording remains
too, until it no longer holds.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from fnmatch import fnmatchcase
from typing import Any
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.candidates import active_parts
from service.alerts.lifecycle import CLOSED, ON_HOLD, PENDING, REPORTED, has_changed
from service.alerts.tables import Alert, Silence
from service.analyses import queries as analysis_queries
from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.records.tables import Event
from service.verdict import earthquakes
from service.verdict.assessment import Assessment

GRAVITY = ("limit", "deterioration", "sensor", "model", "recovery", "data")
"""Kinds of alerts, the gravest first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertFacts:
    """An alert as messages report it."""

    id: int
    cause: str
    kind: str
    state: str
    summary: str
    sentences: tuple[str, ...]
    evidence: Mapping[str, Any]
    began_at: datetime
    changed_after: datetime | None = None
    """Start of the last event that did not show it; None for a periodic check."""
    changed_by: datetime | None = None
    """Start of the first event that certainly did."""
    end: str = ""
    """Reason of the end, and the person who ended it; empty while it is open."""
    silenced_until: datetime | None = None
    """Local time; None where no silence applies."""
    silence_reason: str = ""

    @property
    def status(self) -> str:
        """The state as messages list it; an acknowledgement is no news, so it does not show."""
        return "active" if self.state in REPORTED else self.state.replace("_", " ")

    @property
    def is_reported(self) -> bool:
        """True if it is active or acknowledged, and not silenced."""
        return self.state in REPORTED and self.silenced_until is None

    @property
    def is_silenced(self) -> bool:
        """True if it is active or acknowledged, and silenced."""
        return self.state in REPORTED and self.silenced_until is not None

    @property
    def is_on_hold(self) -> bool:
        """True if another alert may explain it."""
        return self.state == ON_HOLD

    @property
    def has_ended(self) -> bool:
        """True if it was resolved or withdrawn."""
        return self.state in CLOSED


@dataclass(frozen=True, slots=True, kw_only=True)
class EventFacts:
    """An earthquake as messages report it; SI units, times in the building's zone."""

    id: int
    building_id: int
    code: str
    name: str
    start: datetime
    end: datetime
    refusal: str | None
    """Reason why its records cannot be used; None if it was analysed."""
    pga: float | None
    """m/s²."""
    displacements: Mapping[str, float]
    """m, largest isolator displacement by direction."""
    resultant: float | None
    """m, the largest in plan."""
    residuals: Mapping[str, tuple[float, float | None]]
    """m, by direction, where a transducer measured it: value and standard deviation (None: unknown)."""
    forces: Mapping[str, float]
    """N, by direction."""
    assessment: Assessment
    alerts: tuple[AlertFacts, ...]
    """Alerts reported with it, the gravest first; an ended one only if it was reported before."""
    moved: tuple[AlertFacts, ...]
    """Alerts that were reported with this earthquake, and are reported with another one now."""

    @property
    def largest(self) -> float | None:
        """m, largest isolator displacement, a lower bound where one direction is known; None where none is."""
        return max(self.displacements.values(), default=None) if self.resultant is None else self.resultant


@dataclass(frozen=True, slots=True, eq=False)
class ReportedEvent:
    """An earthquake that messages report."""

    event: Event
    alerts: Collection[int]
    """Numbers of the alerts in its earlier messages."""
    as_of: datetime | None = None
    """The verdict counts the alerts that were open at that time; None: those that are open now."""


@dataclass(frozen=True, slots=True)
class Report:
    """The earthquake whose messages report an alert."""

    event_id: int
    start: datetime
    alert: Mapping[str, Any] | None
    """Data of the alert in the last of these messages; None before the first."""


def event_facts(
    session: Session, building: Building, reported: Sequence[ReportedEvent], now: datetime
) -> list[EventFacts]:
    """The facts that a message about each event reports, in their order, by as many statements as one event takes.

    Args:
        session: to read with.
        building: of the events.
        reported: events that were analysed, refused, or failed.
        now: aware time.
    """
    zone = ZoneInfo(building_store.described(session, building).timezone)
    numbers = {one.event.id for one in reported if one.event.state == "analysed"}
    current = (Analysis.event_id.in_(numbers), Analysis.current, Analysis.refusal.is_(None))
    analyses = {one.event_id: one for one in session.scalars(select(Analysis).where(*current))}
    of_analyses = [one.id for one in analyses.values()]
    results = analysis_queries.by_analysis(session, DirectionResult, of_analyses)
    layers = analysis_queries.by_analysis(session, LayerResult, of_analyses)
    verdicts = earthquakes.of_events_at(session, building, [(one.event, one.as_of) for one in reported])
    alerts = _alerts_of_events(session, building, reported, zone, now)
    found = []
    for one, verdict, (here, moved) in zip(reported, verdicts, alerts, strict=True):
        analysis = analyses.get(one.event.id)
        number = 0 if analysis is None else analysis.id
        directions = sorted(results.get(number, ()), key=lambda result: result.direction)
        layer = next(iter(layers.get(number, ())), None)
        found.append(
            EventFacts(
                id=one.event.id,
                building_id=building.id,
                code=building.code,
                name=building.name,
                start=one.event.start.astimezone(zone),
                end=one.event.end.astimezone(zone),
                refusal=None if analysis else (one.event.reason or "no reason was noted").rstrip("."),
                pga=analysis.pga if analysis else None,
                displacements={
                    result.direction: result.peak_displacement
                    for result in directions
                    if result.peak_displacement is not None
                },
                resultant=layer.peak_resultant if layer else None,
                residuals={
                    result.direction: (result.residual_displacement, result.residual_displacement_std)
                    for result in directions
                    if result.residual_displacement is not None
                },
                forces={result.direction: result.peak_force for result in directions},
                assessment=verdict,
                alerts=here,
                moved=moved,
            )
        )
    return found


def alert_facts(alert: Alert, silences: Sequence[Silence], zone: ZoneInfo, now: datetime) -> AlertFacts:
    """An alert as messages report it."""
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
    """Sorting key of alerts, the gravest first."""
    return GRAVITY.index(alert.kind), alert.id


def silence_of(alert: Alert, silences: Sequence[Silence], now: datetime) -> Silence | None:
    """The silence that applies to an alert, the one that lasts longest; None if there is none."""
    current = (one for one in silences if one.starts_at <= now < one.ends_at and _matches(alert, one.pattern))
    return max(current, key=lambda one: one.ends_at, default=None)


def event_key(event_id: int) -> str:
    """Key of the messages about an event."""
    return f"event/{event_id}"


def alert_key(alert_id: int) -> str:
    """Key of the messages about an alert that no event raised."""
    return f"alert/{alert_id}"


def message_key(session: Session, alert: Alert, reports: Mapping[int, Report]) -> str:
    """Key of the messages that report an alert: those of its event, or its own."""
    if alert.raised_event_id is None:
        return alert_key(alert.id)
    return event_key(_report(session, alert, reports).event_id)


def reports_by_alert(session: Session, building_id: int) -> dict[int, Report]:
    """By number of an alert, the event whose messages reported it last."""
    reports: dict[int, Report] = {}
    for message in queries.messages_of_alerts(session, building_id):
        start = datetime.fromisoformat(message.data["start"])
        for alert in message.data["alerts"]:
            reports[alert["id"]] = Report(message.data["event"], start, alert)
    return reports


def _alerts_of_events(
    session: Session, building: Building, reported: Sequence[ReportedEvent], zone: ZoneInfo, now: datetime
) -> Iterator[tuple[tuple[AlertFacts, ...], tuple[AlertFacts, ...]]]:
    """By event: alerts that are reported with it, and those that were and are reported with another one now."""
    silences, reports = queries.silences(session, building.id), reports_by_alert(session, building.id)
    events = {one.event.id for one in reported}
    here = {number for number, report in reports.items() if report.event_id in events}
    alerts = queries.of_events(session, events, here.union(*(one.alerts for one in reported)))
    places = {alert.id: _report(session, alert, reports) for alert in alerts}
    facts = {alert.id: alert_facts(alert, silences, zone, now) for alert in alerts}
    at: dict[int, list[int]] = defaultdict(list)
    for number, place in places.items():
        at[place.event_id].append(number)
    for one in reported:
        shown = [
            _as_reported(facts[number], places[number])
            for number in at[one.event.id]
            if facts[number].state != PENDING and (not facts[number].has_ended or number in one.alerts)
        ]
        moved = [facts[number] for number in sorted(one.alerts) if places[number].event_id != one.event.id]
        yield tuple(sorted(shown, key=gravity)), tuple(moved)


def _report(session: Session, alert: Alert, reports: Mapping[int, Report]) -> Report:
    """Place of an alert raised by an event: if it began after that earthquake, it is another change."""
    before = reports.get(alert.id)
    if before is not None and not _began_after(alert, before.start):
        return before
    event = session.get_one(Event, alert.raised_event_id)
    return Report(event.id, event.start, None)


def _began_after(alert: Alert, start: datetime) -> bool:
    """True if it certainly began after the earthquake of that start."""
    return alert.began_at > start and (alert.changed_after is None or alert.changed_after >= start)


def _as_reported(facts: AlertFacts, report: Report) -> AlertFacts:
    """In the wording of the earlier message, as long as that holds."""
    before = report.alert
    if before is None or datetime.fromisoformat(before["began_at"]) != facts.began_at:
        return facts
    if has_changed(before["evidence"], facts.evidence):
        return facts
    return replace(facts, summary=before["summary"], sentences=tuple(before["sentences"]), evidence=before["evidence"])


def _end(alert: Alert) -> str:
    """Reason of the end, and the person who ended it."""
    last = alert.changes[-1]
    return last.note if last.by is None else f"{last.by}: {last.note}"


def _matches(alert: Alert, pattern: str) -> bool:
    """True if a pattern matches an alert's cause, or each of its active parts (`stiffness/x`)."""
    parts = active_parts(alert.evidence)
    every = bool(parts) and all(fnmatchcase(f"{alert.cause}/{one}", pattern) for one in parts)
    return every or fnmatchcase(alert.cause, pattern)
