"""The content of messages about earthquakes, alerts and open alerts to remind of; their sentences are in `texts`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from core.rounding import significant, with_std
from service.alerts import texts
from service.alerts.message_facts import AlertFacts, EventFacts, alert_key, event_key
from service.alerts.tables import Alert
from service.buildings.recipient_rules import Severity
from service.notify.outbox import MessageContent, Order
from service.verdict import texts as verdict_texts
from service.verdict.checks import Check, Level
from service.verdict.limits import STIFFNESS_CHANGE
from service.verdict.schema import verdict_json

SEVERITIES: dict[str, Severity] = {
    "limit": "alarm",
    "deterioration": "alarm",
    "sensor": "warning",
    "model": "warning",
    "recovery": "note",
}
"""By kind of alert; data health alerts are warnings."""
GRAVEST: tuple[Severity, ...] = ("alarm", "warning", "note", "normal")
LEVEL_SEVERITIES: Mapping[Level, Severity] = {
    Level.ACT: "alarm",
    Level.INSPECT: "alarm",
    Level.NO_DATA: "warning",
    Level.UNDECIDED: "note",
    Level.WATCH: "note",
    Level.NORMAL: "normal",
}
GAL, KN, MM = 1e2, 1e-3, 1e3
FOR_EVERYBODY = 2
"""Sentences of an alert that make its first paragraph: what follows from it, and since when it is so."""
REMINDER_KEY = "reminder"
"""Key of a building's reminders."""


@dataclass(frozen=True, slots=True)
class Earlier:
    """The earlier messages about an event."""

    is_empty: bool
    had_results: bool
    """True if one of them reported results."""
    alerts: frozenset[int]
    """Numbers of the alerts in them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unacknowledged:
    """An active alert that was reported and has not been acknowledged."""

    facts: AlertFacts
    activated_at: datetime
    reported_at: datetime
    """Time of the last message about it."""


def event_content(facts: EventFacts, earlier: Earlier) -> MessageContent:
    """The message about an event, after the earlier ones."""
    ended = [one for one in facts.alerts if one.has_ended] + list(facts.moved)
    is_open = any(one.is_reported or one.is_on_hold for one in facts.alerts)
    reported = [one for one in facts.alerts if one.is_reported]
    return MessageContent(
        key=event_key(facts.id),
        building_id=facts.building_id,
        kind="alert" if is_open or ended else "event",
        sequence=_sequence(facts, earlier),
        severity=_severity(facts),
        subject=texts.EVENT_SUBJECT.format(when=texts.local_time(facts.start), outcome=_outcome(facts, ended)),
        sentences=(*_motion(facts), *_alerts(facts), *_ended(ended), *_verdict(facts)),
        facts=tuple(_numbers(facts)),
        link=_alert_link(facts.code, reported) if reported else f"/events/{facts.id}",
        picture=_picture(facts),
        data=_event_data(facts),
        has_ended=not is_open,
    )


def alert_content(alert: Alert, facts: AlertFacts, was_reported: bool, zone: ZoneInfo) -> MessageContent:
    """The message about an alert that no event raised."""
    since = texts.local_time(alert.began_at.astimezone(zone))
    values = {"summary": facts.summary, "since": since, "end": facts.end}
    ended = facts.has_ended
    return MessageContent(
        key=alert_key(alert.id),
        building_id=alert.building_id,
        kind="data" if alert.kind == "data" else "alert",
        sequence="cancelled" if facts.state == "withdrawn" else "updated" if was_reported else "new",
        severity="note" if ended else "warning",
        has_ended=ended,
        subject=texts.ENDED_SUBJECT.format(**values) if ended else facts.summary,
        sentences=(
            (texts.ALERT_ENDED.format(**values),) if ended else (texts.ALERT_SINCE.format(**values), *facts.sentences)
        ),
        facts=((texts.FACT_SINCE, _utc(alert.began_at)), (texts.FACT_ABOUT, texts.cause(alert.cause))),
        link=_alert_link(alert.building.code, [facts]),
        data={
            "building": alert.building.code,
            "alert": alert.id,
            "cause": alert.cause,
            "state": alert.state,
            "since": _iso(alert.began_at),
            "evidence": dict(alert.evidence),
        },
    )


def reminder_content(
    building_id: int, code: str, name: str, zone: ZoneInfo, alerts: Sequence[Unacknowledged], interval: timedelta
) -> MessageContent:
    """The reminder of a building's unacknowledged alerts; one at least, the gravest first."""
    every = [one.facts for one in alerts]
    kinds = {one.kind for one in every}
    summary = every[0].summary + texts.and_more(len(every))
    return MessageContent(
        key=REMINDER_KEY,
        building_id=building_id,
        kind="data" if kinds == {"data"} else "alert",
        sequence="repeat",
        severity=min((SEVERITIES.get(one, "warning") for one in kinds), key=GRAVEST.index),
        subject=texts.REMINDER_SUBJECT.format(summary=summary),
        sentences=(
            texts.REMINDER_OPENING.format(name=name),
            *(
                texts.REMINDER_ALERT.format(
                    summary=one.facts.summary, since=texts.local_time(one.activated_at.astimezone(zone))
                )
                for one in alerts
            ),
            texts.REMINDER_HOW,
            texts.REMINDER_AGAIN.format(interval=texts.duration(interval)),
        ),
        facts=tuple(
            (texts.FACT_ALERT.format(id=one.id), f"{texts.cause(one.cause)}: {verdict_texts.STATE_NAMES[one.state]}")
            for one in every
        ),
        link=_alert_link(code, every),
        data={"building": code, "alerts": [_reminder_data(one) for one in alerts]},
    )


def _sequence(facts: EventFacts, earlier: Earlier) -> Order:
    """Cancelled: every alert that was reported is withdrawn, or the records cannot be used after all."""
    if earlier.is_empty:
        return "new"
    if facts.refusal is not None:
        return "cancelled" if earlier.had_results else "updated"
    reported = [one for one in (*facts.alerts, *facts.moved) if one.id in earlier.alerts]
    never_were = bool(reported) and all(one.state == "withdrawn" for one in reported)
    return "cancelled" if never_were and not any(one.is_reported for one in facts.alerts) else "updated"


def _severity(facts: EventFacts) -> Severity:
    severities = {SEVERITIES[one.kind] for one in facts.alerts if one.is_reported}
    if any(one.is_on_hold or one.is_silenced for one in facts.alerts):
        severities.add("note")
    return min((*severities, LEVEL_SEVERITIES[facts.assessment.level]), key=GRAVEST.index)


def _outcome(facts: EventFacts, ended: Sequence[AlertFacts]) -> str:
    """The subject after the time of the earthquake."""
    length = None if facts.largest is None else texts.length(facts.largest)
    if facts.refusal is not None:
        return texts.UNUSABLE
    if reported := [one for one in facts.alerts if one.is_reported]:
        return reported[0].summary + texts.and_more(len(reported))
    if waiting := [one for one in facts.alerts if one.is_on_hold or one.is_silenced]:
        is_bound = facts.resultant is None
        moved = texts.MOVED_AT_LEAST_ON_HOLD_OR_MUTED if is_bound else texts.MOVED_ON_HOLD_OR_MUTED
        template = texts.ON_HOLD_OR_MUTED if length is None else moved
        return template.format(length=length, count=len(waiting), s="s" * (len(waiting) > 1))
    headline = verdict_texts.headline(facts.assessment)
    if ended:
        has_moved = any(not one.has_ended for one in ended)
        return f"{texts.REPORTED_ELSEWHERE if has_moved else texts.ALERTS_ENDED}; {headline}"
    template = texts.MOVED_AT_LEAST if facts.resultant is None else texts.MOVED
    return headline if length is None else template.format(length=length, outcome=headline)


def _motion(facts: EventFacts) -> Iterator[str]:
    values = {"name": facts.name, "when": texts.local_time(facts.start), "reason": facts.refusal}
    if facts.refusal is not None:
        yield texts.RECORDED_UNUSABLE.format(**values)
        yield texts.INSPECT_IF_STRONG
    elif facts.largest is None:
        yield texts.RECORDED_NO_DISPLACEMENT.format(**values)
    else:
        template = texts.RECORDED_AT_LEAST if facts.resultant is None else texts.RECORDED
        direction = max(facts.displacements, key=lambda one: facts.displacements[one], default="")
        yield template.format(**values, length=texts.length(facts.largest), direction=direction)


def _alerts(facts: EventFacts) -> Iterator[str]:
    for one in facts.alerts:
        if one.is_reported and one.kind == "limit":  # the verdict has the rest
            yield f"{one.summary}. {one.sentences[0]}"
        elif one.is_reported:
            yield " ".join((f"{one.summary}.", *one.sentences[:FOR_EVERYBODY]))
            yield from one.sentences[FOR_EVERYBODY:]
        elif one.is_on_hold:
            yield texts.ALERT_ON_HOLD.format(summary=one.summary)
        elif one.is_silenced and one.silenced_until is not None:
            yield texts.ALERT_MUTED.format(
                cause=texts.cause(one.cause), until=texts.local_time(one.silenced_until), reason=one.silence_reason
            )


def _ended(ended: Sequence[AlertFacts]) -> Iterator[str]:
    for one in ended:
        if not one.has_ended:
            yield texts.ALERT_MOVED.format(summary=one.summary)
        elif one.state == "withdrawn":
            yield texts.ALERT_WITHDRAWN.format(summary=one.summary, end=one.end)
        else:
            yield texts.ALERT_RESOLVED.format(summary=one.summary, end=one.end)


def _verdict(facts: EventFacts) -> Iterator[str]:
    """The verdict with everything that weakens it."""
    if facts.refusal is None:
        yield from verdict_texts.sentences(facts.assessment)
    here = {one.id for one in facts.alerts}
    if others := [texts.cause(one.cause) for one in facts.assessment.alerts if one.id not in here]:
        yield texts.ALSO_OPEN.format(causes=texts.listed(others))


def _numbers(facts: EventFacts) -> Iterator[tuple[str, str]]:
    yield texts.FACT_EVENT, _utc(facts.start)
    if facts.pga is not None:
        yield texts.FACT_PGA, f"{significant(facts.pga * GAL)} gal"
    for direction, value in facts.displacements.items():
        yield texts.FACT_DISPLACEMENT.format(direction=direction), f"{significant(value * MM)} mm"
    if facts.resultant is not None:
        yield texts.FACT_RESULTANT, f"{significant(facts.resultant * MM)} mm"
    for direction, (value, std) in facts.residuals.items():
        in_mm = with_std(value * MM, None if std is None else std * MM, "mm")
        yield texts.FACT_RESIDUAL.format(direction=direction), in_mm
    for direction, value in facts.forces.items():
        yield texts.FACT_FORCE.format(direction=direction), f"{significant(value * KN)} kN"
    for check in facts.assessment.checks:
        yield texts.FACT_CHECK.format(title=verdict_texts.title(check)), _check_outcome(check)
    for one in facts.alerts:
        yield texts.FACT_ALERT.format(id=one.id), f"{texts.cause(one.cause)}: {one.status}"


def _check_outcome(check: Check) -> str:
    """`147.50 ± 0.20 %, exceeded: limit 100 % (watch)`; a change of stiffness without its value.

    That value moves a little with every later earthquake, which alone is no news.
    """
    value, limit = verdict_texts.value(check), verdict_texts.limit(check)
    outcome = texts.OUTCOME_OF_LIMIT.format(outcome=check.outcome.value, limit=limit) if limit else check.outcome.value
    return f"{value}, {outcome}" if value and check.name != STIFFNESS_CHANGE else outcome


def _alert_link(code: str, alerts: Sequence[AlertFacts]) -> str:
    return f"/alerts/{alerts[0].id}" if len(alerts) == 1 else f"/buildings/{code}/alerts"


def _picture(facts: EventFacts) -> tuple[int, str] | None:
    """The hysteresis loop of the direction with the largest displacement."""
    moved = facts.displacements
    return (facts.id, max(moved, key=lambda direction: moved[direction])) if moved else None


def _event_data(facts: EventFacts) -> dict[str, Any]:
    return {
        "building": facts.code,
        "event": facts.id,
        "start": _iso(facts.start),
        "end": _iso(facts.end),
        "refusal": facts.refusal,
        "pga": facts.pga,
        "peak_displacement": dict(facts.displacements),
        "peak_resultant": facts.resultant,
        "residual_displacement": {direction: value for direction, (value, _) in facts.residuals.items()},
        "peak_force": dict(facts.forces),
        "verdict": verdict_json(facts.assessment),
        "alerts": [_alert_data(one) for one in facts.alerts if one.silenced_until is None],
    }


def _alert_data(one: AlertFacts) -> dict[str, Any]:
    return {
        "id": one.id,
        "cause": one.cause,
        "kind": one.kind,
        "state": one.state,
        "began_at": _iso(one.began_at),
        "changed_after": one.changed_after and _iso(one.changed_after),
        "changed_by": one.changed_by and _iso(one.changed_by),
        "evidence": dict(one.evidence),
        "summary": one.summary,
        "sentences": list(one.sentences),
    }


def _reminder_data(one: Unacknowledged) -> dict[str, Any]:
    facts = one.facts
    return {
        "id": facts.id,
        "cause": facts.cause,
        "kind": facts.kind,
        "state": facts.state,
        "activated_at": _iso(one.activated_at),
        "evidence": dict(facts.evidence),
        "summary": facts.summary,
    }


def _utc(moment: datetime) -> str:
    return f"{moment.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def _iso(moment: datetime) -> str:
    return moment.astimezone(UTC).isoformat()
