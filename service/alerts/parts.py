"""Findings about the directions of one layer as one finding, of which they are the parts.

The directions x and y and the mean of both are measured on one set of isolators: who looks after one looks after all.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from itertools import chain
from typing import Any

from core.drift.pooled import BOTH_DIRECTIONS
from service.alerts.candidates import Found
from service.alerts.words import RECOVERED, of_subject

OF_THE_LAYER = frozenset({"stiffness", "damping", "residual_displacement"})
"""Quantities of which the directions belong together."""


def alert_cause(cause: str) -> str:
    """Cause of the alert that a finding belongs to: `stiffness` of `stiffness/x`, any other cause as it is."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return f"{RECOVERED}/{alert_cause(rest)}"
    return first if first in OF_THE_LAYER else cause


def subject(found: Found) -> str | None:
    """`x`, `y` or `xy` of a part; None of a finding that belongs to no others."""
    return None if alert_cause(found.cause) == found.cause else found.cause.rpartition("/")[2]


def joined(parts: Sequence[Found], held: Mapping[str, Found]) -> Found:
    """The parts of one alert as one finding: what is said first is the newest change that nothing else explains.

    Args:
        parts: one at least; of one alert.
        held: by cause of the parts that another finding may explain, that finding.
    """
    (first, *others) = parts
    if subject(first) is None and not others:
        return replace(first, sentences=(*first.sentences[:1], *_when(first, parts), *first.sentences[1:]))
    counted = _counted(parts, held)
    newest = _of_newest_change(counted)
    lead = _lead(newest)
    raised = min(newest, key=lambda part: part.raised_at)
    return replace(
        lead,
        cause=alert_cause(lead.cause),
        raised_at=raised.raised_at,
        raised_event_id=raised.raised_event_id,
        event_ids=_in_order([lead.event_ids, *(part.event_ids for part in newest)]),
        channels=tuple(dict.fromkeys(chain.from_iterable(part.channels for part in (lead, *newest)))),
        evidence={**lead.evidence, "parts": [_written(part, held) for part in parts]},
        summary=_summary(lead, newest, counted),
        sentences=(*lead.sentences[:1], *_when(lead, counted), *lead.sentences[1:]),
    )


def part_then(evidence: Mapping[str, Any], found: Found) -> Mapping[str, Any]:
    """What was known of a part when something was done about its alert; of a part that was not known, of the whole."""
    parts: dict[str | None, Mapping[str, Any]] = {part["subject"]: part for part in evidence.get("parts", ())}
    return parts.get(subject(found), evidence)


def _counted(parts: Sequence[Found], held: Mapping[str, Found]) -> Sequence[Found]:
    """Those that are sure and not explained by others; else those that are sure; else all."""
    sure = [part for part in parts if part.is_sure]
    return [part for part in sure if part.cause not in held] or sure or parts


def _of_newest_change(parts: Sequence[Found]) -> Sequence[Found]:
    """The parts that may tell of the same change as the one that began last."""
    last = max(parts, key=_earliest)
    return [part for part in parts if _latest(part) > _earliest(last)]


def _earliest(part: Found) -> datetime:
    """After which it began; of a change within one event just before that."""
    before = _latest(part) - timedelta.resolution
    return before if part.changed_after is None else min(part.changed_after, before)


def _latest(part: Found) -> datetime:
    return part.changed_by or part.began_at


def _lead(parts: Sequence[Found]) -> Found:
    """The mean of both directions, unless one of them differs from it beyond doubt; else the largest."""
    by_subject = {subject(part): part for part in parts}
    both = by_subject.get(BOTH_DIRECTIONS)
    largest = max(parts, key=lambda part: abs(part.evidence.get("drift", 0.0)))
    if both is None or not _within(both.evidence.get("drift"), largest.evidence):
        return largest
    return both


def _within(value: float | None, evidence: Mapping[str, Any]) -> bool:
    low, high = evidence.get("low"), evidence.get("high")
    return value is None or low is None or high is None or low <= value <= high


def _summary(lead: Found, newest: Sequence[Found], counted: Sequence[Found]) -> str:
    earlier = [part for part in counted if part not in newest]
    if not earlier:
        return lead.summary
    return f"{lead.summary}, besides an earlier change in {of_subject(subject(earlier[0]) or '')}"


def _when(lead: Found, counted: Sequence[Found]) -> Iterable[str]:
    """When it began, then each of the other parts with its own date; a sentence each."""
    if lead.dated:
        yield lead.dated
    for part in counted:
        if part is not lead:
            yield " ".join(one for one in (f"{part.summary}.", part.dated) if one)


def _written(part: Found, held: Mapping[str, Found]) -> dict[str, Any]:
    """As JSON."""
    by = held.get(part.cause)
    return {
        "subject": subject(part),
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
    found: list[int] = []
    for order in orders:
        place = 0
        for event in order:
            if event in found:
                place = found.index(event) + 1
            else:
                found.insert(place, event)
                place += 1
    return tuple(found)
