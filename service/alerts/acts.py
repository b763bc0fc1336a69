"""What people do about an alert, and which findings that answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from service.alerts.candidates import Found
from service.alerts.parts import alert_cause, part_then
from service.alerts.states import RESOLVED, WITHDRAWN

Outcome = Literal["confirmed", "unfounded"]
OUTCOMES: Mapping[Outcome, str] = {"confirmed": RESOLVED, "unfounded": WITHDRAWN}
"""Of an inspection or a review, and the state that the alert is in afterwards."""


@dataclass(frozen=True, slots=True)
class Act:
    """Somebody acknowledged an alert, or ended it by an inspection."""

    cause: str
    at: datetime
    by: str
    note: str
    ends: bool
    """Whether it was an inspection; an alert that was only acknowledged stands."""
    evidence: Mapping[str, Any]
    """What was known then."""

    def answers(self, found: Found) -> bool:
        """Whether it holds for a finding: of its alert, of what began before, and no worse than it was then."""
        if self.cause != alert_cause(found.cause) or found.began_at > self.at:
            return False
        return not is_worse(part_then(self.evidence, found), found.evidence)


def latest(acts: Sequence[Act], found: Sequence[Found], *, ends: bool) -> Act | None:
    """The last act of that sort that answers all of these findings."""
    answering = [act for act in acts if act.ends == ends and all(act.answers(one) for one in found)]
    return max(answering, key=lambda act: act.at, default=None)


def is_worse(then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether a drift has grown beyond doubt: its 95 % interval lies wholly beyond that of then, away from none."""
    values = [evidence.get(key) for evidence in (then, now) for key in ("low", "high")]
    low_then, high_then, low, high = values
    if low_then is None or high_then is None or low is None or high is None:
        return False
    return bool(high < low_then if low + high < 0 else low > high_then)


def differs(then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether what was said of a drift no longer holds: another rule found it, it left the 95 % interval of then, or it
    shows in another direction too."""
    if _active_parts(now) - _active_parts(then):
        return True
    drift, low, high = now.get("drift"), then.get("low"), then.get("high")
    if drift is None or low is None or high is None or then.get("rule") != now.get("rule"):
        return then != now
    return not low <= drift <= high


def _active_parts(evidence: Mapping[str, Any]) -> set[str]:
    return {part["subject"] for part in evidence.get("parts", ()) if part["state"] == "active"}
