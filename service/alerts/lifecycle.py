"""The lifecycle of an alert: its states, operator actions, and the decision which state it has now.

`decide` is a pure function: the same candidates and actions give the same open alerts, whatever happened in between.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from service.alerts import texts
from service.alerts.candidates import (
    AlertCandidate,
    active_parts,
    alert_cause,
    explanation,
    hold_reason,
    merged,
    part_evidence,
)

PENDING, ON_HOLD, ACTIVE, ACKNOWLEDGED = "pending", "on_hold", "active", "acknowledged"
RESOLVED, WITHDRAWN = "resolved", "withdrawn"
REPORTED = frozenset({ACTIVE, ACKNOWLEDGED})
"""Open states that messages report."""
CLOSED = frozenset({RESOLVED, WITHDRAWN})

Outcome = Literal["confirmed", "unfounded"]
OUTCOMES: Mapping[Outcome, str] = {"confirmed": RESOLVED, "unfounded": WITHDRAWN}
"""State of an alert after an inspection or a review with that outcome."""


@dataclass(frozen=True, slots=True)
class OperatorAction:
    """An acknowledgement of an alert, or an inspection that ended one."""

    cause: str
    at: datetime
    by: str
    note: str
    ends: bool
    """True if it was an inspection; an acknowledged alert remains open."""
    evidence: Mapping[str, Any]
    """Evidence of the alert at that time."""

    def covers(self, candidate: AlertCandidate) -> bool:
        """True if it applies to a candidate: of the same alert, begun before, and no worse than at that time."""
        if self.cause != alert_cause(candidate.cause) or candidate.began_at > self.at:
            return False
        return not is_worse(part_evidence(self.evidence, candidate), candidate.evidence)


@dataclass(frozen=True, slots=True)
class OpenAlert:
    """An open alert, as far as its end depends on it."""

    cause: str
    kind: str
    was_active: bool
    is_revised: bool
    """True if its events have results that are newer than its evidence."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The state that the alert of a cause should have."""

    cause: str
    state: str
    candidate: AlertCandidate | None
    """None for an alert that ends because it has no candidate."""
    held_by: str | None = None
    note: str = ""
    """The reason, where the candidate does not give it."""
    acknowledgement: OperatorAction | None = None


def decide(
    candidates: Sequence[AlertCandidate], open_alerts: Sequence[OpenAlert], actions: Sequence[OperatorAction]
) -> tuple[Decision, ...]:
    """The state of every alert of one building in the kinds of one scope; an alert without a decision stays as it is.

    Args:
        candidates: all of now, at most one per cause; those of one layer's directions become one alert.
        open_alerts: at most one per cause.
        actions: what operators did about the building's alerts, ended ones included.
    """
    inspections = {one.cause: latest_action(actions, [one], ends=True) for one in candidates}
    live = [one for one in candidates if inspections[one.cause] is None]
    before = {one.cause: one for one in open_alerts}
    alerts = _by_alert(live)
    return (
        *(
            decision
            for cause, parts in alerts.items()
            for decision in _supported(parts, live, before.get(cause), actions)
        ),
        *_inspected([one for one in candidates if alert_cause(one.cause) not in alerts], before, inspections),
        *_unsupported(open_alerts, {alert_cause(one.cause) for one in candidates}),
    )


def latest_action(
    actions: Sequence[OperatorAction], candidates: Sequence[AlertCandidate], *, ends: bool
) -> OperatorAction | None:
    """The last inspection (or acknowledgement) that covers all of these candidates."""
    covering = [action for action in actions if action.ends == ends and all(action.covers(one) for one in candidates)]
    return max(covering, key=lambda action: action.at, default=None)


def is_worse(then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """True if a drift has grown beyond doubt: its 95 % interval lies wholly beyond the earlier one, away from zero."""
    values = [evidence.get(key) for evidence in (then, now) for key in ("low", "high")]
    low_then, high_then, low, high = values
    if low_then is None or high_then is None or low is None or high is None:
        return False
    return bool(high < low_then if low + high < 0 else low > high_then)


def has_changed(then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """True if an earlier description of a drift no longer holds: another rule applies, the drift left the earlier 95 %
    interval, or it shows in another direction too."""
    if set(active_parts(now)) - set(active_parts(then)):
        return True
    drift, low, high = now.get("drift"), then.get("low"), then.get("high")
    if drift is None or low is None or high is None or then.get("rule") != now.get("rule"):
        return then != now
    return not low <= drift <= high


def _by_alert(candidates: Sequence[AlertCandidate]) -> Mapping[str, Sequence[AlertCandidate]]:
    """Candidates by cause of their alert."""
    parts: dict[str, list[AlertCandidate]] = defaultdict(list)
    for one in candidates:
        parts[alert_cause(one.cause)].append(one)
    return parts


def _supported(
    parts: Sequence[AlertCandidate],
    live: Sequence[AlertCandidate],
    before: OpenAlert | None,
    actions: Sequence[OperatorAction],
) -> Iterator[Decision]:
    """The decision on an alert that has candidates."""
    sure = [part for part in parts if part.is_sure]
    explained = {part.cause: by for part in sure if (by := explanation(part, live)) is not None}
    whole = merged(parts, explained)
    if not sure:
        if before is None or not _needs_inspection(before):
            yield Decision(whole.cause, PENDING, whole)
    elif unexplained := [part for part in sure if part.cause not in explained]:
        action = latest_action(actions, unexplained, ends=False)
        yield Decision(whole.cause, ACTIVE if action is None else ACKNOWLEDGED, whole, acknowledgement=action)
    else:
        by = next(iter(explained.values()))
        yield Decision(whole.cause, ON_HOLD, whole, by.cause, hold_reason(by))


def _inspected(
    candidates: Sequence[AlertCandidate],
    before: Mapping[str, OpenAlert],
    inspections: Mapping[str, OperatorAction | None],
) -> Iterator[Decision]:
    """Open alerts whose candidates are all covered by an earlier inspection."""
    last = {alert_cause(one.cause): inspections[one.cause] for one in candidates}
    for cause, inspection in last.items():
        if inspection is not None and cause in before:
            note = texts.COVERED_BY_INSPECTION.format(by=inspection.by, at=inspection.at)
            yield Decision(cause, RESOLVED, None, note=note)


def _unsupported(open_alerts: Sequence[OpenAlert], causes: Collection[str]) -> Iterator[Decision]:
    """Open alerts without a candidate end, unless only an inspection can end them."""
    for one in open_alerts:
        if one.cause in causes or _needs_inspection(one):
            continue
        if not one.was_active:
            yield Decision(one.cause, WITHDRAWN, None, note=texts.EVIDENCE_GONE)
        elif one.kind != "data" and one.is_revised:
            yield Decision(one.cause, WITHDRAWN, None, note=texts.DATA_REVISED)
        else:
            yield Decision(one.cause, RESOLVED, None, note=texts.NO_LONGER)


def _needs_inspection(one: OpenAlert) -> bool:
    """Deterioration and an exceeded limit never resolve by themselves: only an inspection or revised data ends them."""
    return one.kind in ("deterioration", "limit") and one.was_active and not one.is_revised
