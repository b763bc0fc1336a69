"""Alert candidates: what the rules and the checks report about a building, before it becomes an alert.

The directions x and y and their mean are measured on one set of isolators, so their candidates are the parts of one
alert (`merged`). A candidate that another one may explain is put on hold (`explanation`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from itertools import chain
from typing import Any, Literal

from core.drift.quantities import BOTH_DIRECTIONS
from service.alerts import texts
from service.alerts.texts import RECOVERED

Kind = Literal["deterioration", "limit", "recovery", "sensor", "model", "data"]
"""A loss in the building, an exceeded limit, a return to earlier values, a faulty sensor, a model that no longer fits,
and data that stopped."""
Scope = Literal["events", "clock"]
"""The source of a candidate: the rules over all earthquakes of a building, or the periodic checks."""
KINDS: Mapping[Scope, frozenset[Kind]] = {
    "events": frozenset({"deterioration", "limit", "recovery", "sensor", "model"}),
    "clock": frozenset({"data"}),
}
"""Kinds that a scope reports completely: what it leaves out of these is no longer the case."""
LAYER_QUANTITIES = frozenset({"stiffness", "damping", "residual_displacement"})
"""Quantities whose directions are parts of one alert."""
SOURCE = "source"
FROM_THE_SOURCE = ("record", "channel", "clock")
"""First parts of causes that mean nothing new while the source does not answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertCandidate:
    """One condition that the stored results show now; at most one per cause."""

    cause: str
    """Its subject: `stiffness/x`, `frequency/x/1`, `gain/XX.DEMO.01.HNX`, `model/x`, `source`, `disk`, ..."""
    kind: Kind
    is_sure: bool
    """True if the evidence suffices for an active alert; otherwise it is pending."""
    began_at: datetime
    """Start of the first event that shows it, or the time that the check gives."""
    raised_at: datetime
    """Start of the event that completed the evidence, or the time that the check gives."""
    onset_event_id: int | None = None
    """First event that shows it; None for a periodic check."""
    raised_event_id: int | None = None
    """Event that completed the evidence; its message reports the alert."""
    changed_after: datetime | None = None
    """Start of the last event that did not show it; None for a periodic check."""
    changed_by: datetime | None = None
    """Start of the first event that certainly did."""
    event_ids: tuple[int, ...] = ()
    """Events that triggered it, in order of time."""
    channels: tuple[str, ...] = ()
    """The faulty channels of a sensor candidate; for any other the channels that it was measured with."""
    evidence: Mapping[str, Any]
    """JSON values in SI units, with `drift`, `low` and `high` (95 %) where it has a size: they decide whether it has
    become worse."""
    summary: str
    """One line for readers who are not engineers, without a full stop."""
    sentences: tuple[str, ...]
    """Details, first for everybody, then the numbers for the engineer."""
    dated: str = ""
    """Date of its beginning, one sentence; each part of a layer has its own."""


def alert_cause(cause: str) -> str:
    """Cause of the alert that a candidate belongs to: `stiffness` for `stiffness/x`, any other cause unchanged."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return f"{RECOVERED}/{alert_cause(rest)}"
    return first if first in LAYER_QUANTITIES else cause


def part_subject(candidate: AlertCandidate) -> str | None:
    """`x`, `y` or `xy` for a part of a layer; None for a candidate that has no other parts."""
    return None if alert_cause(candidate.cause) == candidate.cause else candidate.cause.rpartition("/")[2]


def part_evidence(evidence: Mapping[str, Any], candidate: AlertCandidate) -> Mapping[str, Any]:
    """Evidence of one part within that of its alert; of the whole alert where the part was not known."""
    parts: dict[str | None, Mapping[str, Any]] = {part["subject"]: part for part in evidence.get("parts", ())}
    return parts.get(part_subject(candidate), evidence)


def active_parts(evidence: Mapping[str, Any]) -> list[str]:
    """Subjects of the active parts in an alert's evidence."""
    return [part["subject"] for part in evidence.get("parts", ()) if part["state"] == "active"]


def merged(parts: Sequence[AlertCandidate], explained: Mapping[str, AlertCandidate]) -> AlertCandidate:
    """The parts of one alert as one candidate, led by the newest change that nothing else explains.

    Args:
        parts: one at least; of one alert.
        explained: by cause of each part that another candidate may explain, that candidate.
    """
    (first, *others) = parts
    if part_subject(first) is None and not others:
        return replace(first, sentences=(*first.sentences[:1], *_dates(first, parts), *first.sentences[1:]))
    relevant = _relevant(parts, explained)
    newest = _newest_change(relevant)
    lead = _lead(newest)
    raised = min(newest, key=lambda part: part.raised_at)
    return replace(
        lead,
        cause=alert_cause(lead.cause),
        raised_at=raised.raised_at,
        raised_event_id=raised.raised_event_id,
        event_ids=_in_order([lead.event_ids, *(part.event_ids for part in newest)]),
        channels=tuple(dict.fromkeys(chain.from_iterable(part.channels for part in (lead, *newest)))),
        evidence={**lead.evidence, "parts": [_part_json(part, explained.get(part.cause)) for part in parts]},
        summary=_summary(lead, [part for part in relevant if part not in newest]),
        sentences=(*lead.sentences[:1], *_dates(lead, relevant), *lead.sentences[1:]),
    )


def explanation(candidate: AlertCandidate, others: Sequence[AlertCandidate]) -> AlertCandidate | None:
    """The earliest candidate that may explain this one; None if there is none."""
    explaining = (
        other for other in others if other.is_sure and (_distorts(other, candidate) or _blocks(other, candidate))
    )
    return min(explaining, key=lambda other: (other.began_at, other.cause), default=None)


def hold_reason(by: AlertCandidate) -> str:
    """Reason why an alert that `by` may explain is on hold."""
    template = texts.ON_HOLD_FOR_SOURCE if by.cause == SOURCE else texts.ON_HOLD_FOR_SENSOR
    return template.format(summary=by.summary)


def _distorts(sensor: AlertCandidate, candidate: AlertCandidate) -> bool:
    """True if a faulty sensor may be the whole cause of a change that was measured with it after it failed."""
    return (
        sensor.kind == "sensor"
        and candidate.kind in ("deterioration", "recovery", "model")
        and sensor.began_at <= candidate.raised_at
        and not set(sensor.channels).isdisjoint(candidate.channels)
    )


def _blocks(source: AlertCandidate, candidate: AlertCandidate) -> bool:
    """True if data stopped because the source sends nothing at all."""
    is_data = candidate.kind == "data" and candidate.cause.partition("/")[0] in FROM_THE_SOURCE
    return source.cause == SOURCE and is_data


def _relevant(parts: Sequence[AlertCandidate], explained: Mapping[str, AlertCandidate]) -> Sequence[AlertCandidate]:
    """The sure and unexplained parts; if there are none the sure ones; if there are none all."""
    sure = [part for part in parts if part.is_sure]
    return [part for part in sure if part.cause not in explained] or sure or parts


def _newest_change(parts: Sequence[AlertCandidate]) -> Sequence[AlertCandidate]:
    """The parts that may show the same change as the one that began last."""
    last = max(parts, key=_earliest)
    return [part for part in parts if _latest(part) > _earliest(last)]


def _earliest(part: AlertCandidate) -> datetime:
    """Lower bound of its beginning; for a change within one event, just before that event."""
    before = _latest(part) - timedelta.resolution
    return before if part.changed_after is None else min(part.changed_after, before)


def _latest(part: AlertCandidate) -> datetime:
    return part.changed_by or part.began_at


def _lead(parts: Sequence[AlertCandidate]) -> AlertCandidate:
    """The mean of both directions, unless the largest part differs from it beyond doubt; then that part."""
    by_subject = {part_subject(part): part for part in parts}
    both = by_subject.get(BOTH_DIRECTIONS)
    largest = max(parts, key=lambda part: abs(part.evidence.get("drift", 0.0)))
    if both is None or not _within(both.evidence.get("drift"), largest.evidence):
        return largest
    return both


def _within(value: float | None, evidence: Mapping[str, Any]) -> bool:
    low, high = evidence.get("low"), evidence.get("high")
    return value is None or low is None or high is None or low <= value <= high


def _summary(lead: AlertCandidate, earlier: Sequence[AlertCandidate]) -> str:
    if not earlier:
        return lead.summary
    subject = texts.subject(part_subject(earlier[0]) or "")
    return texts.BESIDES_EARLIER_CHANGE.format(summary=lead.summary, subject=subject)


def _dates(lead: AlertCandidate, parts: Sequence[AlertCandidate]) -> Iterable[str]:
    """Dates of the beginning of the leading part, then of the others; a sentence each."""
    if lead.dated:
        yield lead.dated
    for part in parts:
        if part is not lead:
            yield " ".join(one for one in (f"{part.summary}.", part.dated) if one)


def _part_json(part: AlertCandidate, by: AlertCandidate | None) -> dict[str, Any]:
    return {
        "subject": part_subject(part),
        "state": "on_hold" if by else "active" if part.is_sure else "pending",
        "held_by": by.cause if by else None,
        **{name: part.evidence.get(name) for name in ("rule", "drift", "low", "high")},
        "began_at": part.began_at.isoformat(),
        "changed_after": part.changed_after and part.changed_after.isoformat(),
        "changed_by": part.changed_by and part.changed_by.isoformat(),
        "events": list(part.event_ids),
        "summary": part.summary,
    }


def _in_order(orders: Sequence[Sequence[int]]) -> tuple[int, ...]:
    """Events of several lists, each in order of time, as one such list."""
    merged_events: list[int] = []
    for order in orders:
        place = 0
        for event in order:
            if event in merged_events:
                place = merged_events.index(event) + 1
            else:
                merged_events.insert(place, event)
                place += 1
    return tuple(merged_events)
