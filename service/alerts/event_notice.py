"""How is an event told, first to people who are no engineers?"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC

from core.rounding import significant, with_std
from service.alerts.event_facts import AlertFacts, EventFacts
from service.alerts.words import listed, of_cause, of_length, of_time
from service.buildings.recipient_rules import Severity
from service.notify.notice import Notice, Sequence
from service.verdict import words
from service.verdict.assessment import STIFFNESS_CHANGE
from service.verdict.checks import Check, Level
from service.verdict.documents import assessment_json

SEVERITIES: dict[str, Severity] = {
    "limit": "alarm",
    "deterioration": "alarm",
    "sensor": "warning",
    "model": "warning",
    "recovery": "note",
}
GRAVEST: tuple[Severity, ...] = ("alarm", "warning", "note", "normal")
OF_LEVEL: Mapping[Level, Severity] = {
    Level.ACT: "alarm",
    Level.INSPECT: "alarm",
    Level.NO_DATA: "warning",
    Level.UNDECIDED: "note",
    Level.WATCH: "note",
    Level.NORMAL: "normal",
}
GAL, KN, MM = 1e2, 1e-3, 1e3
FOR_EVERYBODY = 2
"""Sentences of an alert that stand together: what follows from it, and since when it is so."""


@dataclass(frozen=True, slots=True)
class Before:
    """What people were told of an event before."""

    is_nothing: bool
    gave_result: bool
    """Whether its records could be used, as they were told."""
    alerts: frozenset[int]
    """Numbers of those that they were told of with it."""


def event_notice(facts: EventFacts, before: Before) -> Notice:
    """What there is to tell of an event, after what was told of it before."""
    ended = [one for one in facts.alerts if one.has_ended] + list(facts.moved)
    is_open = any(one.is_news or one.is_held_back for one in facts.alerts)
    return Notice(
        key=key(facts.id),
        building_id=facts.building_id,
        kind="alert" if is_open or ended else "event",
        sequence=_sequence(facts, before),
        severity=_severity(facts),
        subject=_subject(facts, ended),
        sentences=(*_shaken(facts), *_alerts(facts), *_ended(ended), *_verdict(facts)),
        facts=tuple(_numbers(facts)),
        link=_link(facts),
        picture=_picture(facts),
        data=_data(facts),
        has_ended=not is_open,
    )


def key(event_id: int) -> str:
    """Under which messages about an event follow each other."""
    return f"event/{event_id}"


def _sequence(facts: EventFacts, before: Before) -> Sequence:
    """Cancelled: all alerts that were told were none, or the records cannot be used after all."""
    if before.is_nothing:
        return "new"
    if facts.refusal is not None:
        return "cancelled" if before.gave_result else "updated"
    told = [one for one in (*facts.alerts, *facts.moved) if one.id in before.alerts]
    never_were = bool(told) and all(one.state == "withdrawn" for one in told)
    return "cancelled" if never_were and not any(one.is_news for one in facts.alerts) else "updated"


def _severity(facts: EventFacts) -> Severity:
    found = {SEVERITIES[one.kind] for one in facts.alerts if one.is_news}
    if any(one.is_held_back or one.is_silenced for one in facts.alerts):
        found.add("note")
    return min((*found, OF_LEVEL[facts.assessment.level]), key=GRAVEST.index)


def _subject(facts: EventFacts, ended: list[AlertFacts]) -> str:
    moved = "" if facts.largest is None else f"isolators moved {of_length(facts.largest)}, "
    if facts.refusal is not None:
        outcome = "its records cannot be used"
    elif news := [one for one in facts.alerts if one.is_news]:
        more = "" if len(news) == 1 else f" (and {len(news) - 1} more)"
        outcome = news[0].summary + more
    elif held := [one for one in facts.alerts if one.is_held_back or one.is_silenced]:
        outcome = f"{moved}{len(held)} finding{'s' * (len(held) > 1)} held back"
    elif ended:
        moved_on = any(not one.has_ended for one in ended)
        over = "what it raised is told with another one" if moved_on else "what it raised is over"
        outcome = f"{over}; {words.headline(facts.assessment)}"
    else:
        outcome = f"{moved}{words.headline(facts.assessment)}"
    return f"Earthquake of {of_time(facts.start)}: {outcome}"


def _shaken(facts: EventFacts) -> Iterator[str]:
    when = of_time(facts.start)
    if facts.refusal is not None:
        yield f"An earthquake was recorded at {facts.name} on {when}, but its records cannot be used: {facts.refusal}."
        yield "What the isolators did cannot be assessed: have them inspected if it was strong."
    elif facts.largest is None:
        yield f"An earthquake was recorded at {facts.name} on {when}. How far the isolators moved was not measured."
    else:
        yield (
            f"An earthquake was recorded at {facts.name} on {when}. "
            f"The isolators moved by {of_length(facts.largest)} at most."
        )


def _alerts(facts: EventFacts) -> Iterator[str]:
    for one in facts.alerts:
        if one.is_news and one.kind == "limit":  # the verdict has the rest
            yield f"{one.summary}. {one.sentences[0]}"
        elif one.is_news:
            yield " ".join((f"{one.summary}.", *one.sentences[:FOR_EVERYBODY]))
            yield from one.sentences[FOR_EVERYBODY:]
        elif one.is_held_back:
            yield (
                f"It seems that: {one.summary}. But a sensor that took part measures wrongly, which may be all "
                "there is to it. People are told as soon as that is settled."
            )
        elif one.is_silenced and one.silenced_until is not None:
            yield (
                f"One finding ({of_cause(one.cause)}) is not told before {of_time(one.silenced_until)}, as somebody "
                f"wished: {one.silence_reason}."
            )


def _ended(ended: list[AlertFacts]) -> Iterator[str]:
    for one in ended:
        if not one.has_ended:
            yield f"This is told with another earthquake now, by what is known since: {one.summary}."
        elif one.state == "withdrawn":
            yield f"This is cancelled, it never was so: {one.summary}. {one.end}"
        else:
            yield f"This is settled: {one.summary}. {one.end}"


def _verdict(facts: EventFacts) -> Iterator[str]:
    """The verdict with everything that weakens it."""
    if facts.refusal is None:
        yield from words.sentences(facts.assessment)
    here = {one.id for one in facts.alerts}
    if others := [of_cause(one.cause) for one in facts.assessment.alerts if one.id not in here]:
        yield f"Also open at the building: {listed(others)}."


def _numbers(facts: EventFacts) -> Iterator[tuple[str, str]]:
    yield "Earthquake", f"{facts.start.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"
    if facts.pga is not None:
        yield "Largest ground acceleration", f"{significant(facts.pga * GAL)} gal"
    for direction, value in facts.displacements.items():
        yield f"Largest isolator displacement, direction {direction}", f"{significant(value * MM)} mm"
    if facts.resultant is not None:
        yield "Largest isolator displacement in plan", f"{significant(facts.resultant * MM)} mm"
    for direction, (value, std) in facts.residuals.items():
        in_mm = with_std(value * MM, None if std is None else std * MM, "mm")
        yield f"Displacement that remained, direction {direction}", in_mm
    for direction, value in facts.forces.items():
        yield f"Largest restoring force, direction {direction}", f"{significant(value * KN)} kN"
    for check in facts.assessment.checks:
        yield f"Check: {words.title(check)}", _outcome(check)
    for one in facts.alerts:
        yield f"Alert {one.id}", f"{of_cause(one.cause)}: {one.standing}"


def _outcome(check: Check) -> str:
    """`147.50 ± 0.20 %, exceeded: limit 100 % (watch)`; a change of stiffness without its value.

    That value moves a little with every later earthquake, which alone is no news.
    """
    value = "" if check.name == STIFFNESS_CHANGE else words.value(check)
    limit = f"{check.outcome.value}: limit {words.limit(check)}" if words.limit(check) else check.outcome.value
    return f"{value}, {limit}" if value else limit


def _link(facts: EventFacts) -> str:
    told = [one for one in facts.alerts if one.is_news]
    if not told:
        return f"/events/{facts.id}"
    return f"/alerts/{told[0].id}" if len(told) == 1 else f"/buildings/{facts.code}/alerts"


def _picture(facts: EventFacts) -> tuple[int, str] | None:
    """The loop of the direction in which the isolators moved most."""
    moved = facts.displacements
    return (facts.id, max(moved, key=lambda direction: moved[direction])) if moved else None


def _data(facts: EventFacts) -> dict[str, object]:
    return {
        "building": facts.code,
        "event": facts.id,
        "start": facts.start.astimezone(UTC).isoformat(),
        "end": facts.end.astimezone(UTC).isoformat(),
        "refusal": facts.refusal,
        "pga": facts.pga,
        "peak_displacement": dict(facts.displacements),
        "peak_resultant": facts.resultant,
        "residual_displacement": {direction: value for direction, (value, _) in facts.residuals.items()},
        "peak_force": dict(facts.forces),
        "verdict": assessment_json(facts.assessment),
        "alerts": [_alert_data(one) for one in facts.alerts if one.silenced_until is None],
    }


def _alert_data(one: AlertFacts) -> dict[str, object]:
    return {
        "id": one.id,
        "cause": one.cause,
        "kind": one.kind,
        "state": one.state,
        "began_at": one.began_at.astimezone(UTC).isoformat(),
        "changed_after": one.changed_after and one.changed_after.astimezone(UTC).isoformat(),
        "changed_by": one.changed_by and one.changed_by.astimezone(UTC).isoformat(),
        "evidence": dict(one.evidence),
        "summary": one.summary,
        "sentences": list(one.sentences),
    }
