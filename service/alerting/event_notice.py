"""How is an event told, first to people who are no engineers?"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC

from service.alerting.event_facts import AlertFacts, EventFacts
from service.alerting.words import listed, of_cause, of_length, of_time
from service.notices.notice import Notice, Sequence
from service.receiver_rules import Severity

SEVERITIES: dict[str, Severity] = {
    "deterioration": "alarm",
    "sensor": "warning",
    "model": "warning",
    "recovery": "note",
}
GRAVEST: tuple[Severity, ...] = ("alarm", "warning", "note", "all_clear")
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
    about_alerts = any(one.is_news or one.is_held_back for one in facts.alerts) or ended
    return Notice(
        key=key(facts.id),
        building_id=facts.building_id,
        kind="alert" if about_alerts else "event",
        sequence=_sequence(facts, before),
        severity=_severity(facts),
        subject=_subject(facts, ended),
        sentences=(*_shaken(facts), *_alerts(facts), *_ended(ended), *_calm(facts, ended), *_earlier(facts)),
        facts=tuple(_numbers(facts)),
        link=_link(facts),
        picture=_picture(facts),
        data=_data(facts),
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
    if facts.refusal is not None or any(one.is_held_back or one.is_silenced for one in facts.alerts):
        found.add("note")
    return min(found, key=GRAVEST.index, default="all_clear")


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
        outcome = "what it raised is told with another one" if moved_on else "what it raised is over"
    else:
        outcome = f"{moved}nothing unusual"
    return f"Earthquake of {of_time(facts.start)}: {outcome}"


def _shaken(facts: EventFacts) -> Iterator[str]:
    when = of_time(facts.start)
    if facts.refusal is not None:
        yield f"An earthquake was recorded at {facts.name} on {when}, but its records cannot be used: {facts.refusal}."
        yield "So nothing can be said of the isolators in this earthquake: they ought to be looked at if it was strong."
    elif facts.largest is None:
        yield f"An earthquake was recorded at {facts.name} on {when}. How far the isolators moved was not measured."
    else:
        yield (
            f"An earthquake was recorded at {facts.name} on {when}. "
            f"The isolators moved by {of_length(facts.largest)} at most."
        )


def _alerts(facts: EventFacts) -> Iterator[str]:
    for one in facts.alerts:
        if one.is_news:
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


def _calm(facts: EventFacts, ended: list[AlertFacts]) -> Iterator[str]:
    if facts.refusal is not None or any(not one.has_ended for one in facts.alerts):
        return
    yield "Nothing else was unusual." if ended else "Nothing unusual was found; nothing has to be done."
    if facts.displacements and not facts.is_compared:
        yield (
            "Whether the isolators have changed cannot be told from this earthquake: those before are too few, or none "
            "was like it."
        )
    if facts.remarks:
        flaws = "a flaw" if len(facts.remarks) == 1 else f"{len(facts.remarks)} flaws"
        yield f"Some records have {flaws}, so the numbers are less certain: {facts.remarks[0]}"


def _earlier(facts: EventFacts) -> Iterator[str]:
    if facts.earlier:
        yield f"What was told of other earthquakes still stands, and waits for somebody: {listed(facts.earlier)}."


def _numbers(facts: EventFacts) -> Iterator[tuple[str, str]]:
    yield "Earthquake", f"{facts.start.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"
    if facts.pga is not None:
        yield "Largest ground acceleration", f"{facts.pga * GAL:.1f} gal"
    for direction, value in facts.displacements.items():
        yield f"Largest isolator displacement, direction {direction}", f"{value * MM:.1f} mm"
    if facts.resultant is not None:
        yield "Largest isolator displacement in plan", f"{facts.resultant * MM:.1f} mm"
    for direction, value in facts.residuals.items():
        yield f"Displacement that remained, direction {direction}", f"{round(value * MM, 1) + 0.0:.1f} mm"
    for direction, value in facts.forces.items():
        yield f"Largest restoring force, direction {direction}", f"{value * KN:,.0f} kN".replace(",", " ")
    for one in facts.alerts:
        yield f"Alert {one.id}", f"{of_cause(one.cause)}: {one.standing}"


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
        "residual_displacement": dict(facts.residuals),
        "peak_force": dict(facts.forces),
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
