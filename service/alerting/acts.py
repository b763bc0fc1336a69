"""What people do about an alert, and which findings that answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from service.alerting.found import Found
from service.alerting.states import RESOLVED, WITHDRAWN
from service.alerting.words import overlap

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
        """Whether it holds for a finding: of the same cause, of what began before, and no worse than it was then.

        Who looks at a layer looks at both directions: what they tell together is answered with either of them.
        """
        is_about_it = self.cause == found.cause or overlap(self.cause, found.cause)
        return is_about_it and found.began_at <= self.at and not is_worse(self.evidence, found.evidence)


def latest(acts: Sequence[Act], found: Found, *, ends: bool) -> Act | None:
    """The last act of that sort that answers a finding."""
    answering = [act for act in acts if act.ends == ends and act.answers(found)]
    return max(answering, key=lambda act: act.at, default=None)


def is_worse(then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether a drift has grown beyond doubt: its 95 % interval lies wholly beyond that of then, away from none."""
    values = [evidence.get(key) for evidence in (then, now) for key in ("low", "high")]
    low_then, high_then, low, high = values
    if low_then is None or high_then is None or low is None or high is None:
        return False
    return bool(high < low_then if low + high < 0 else low > high_then)


def differs(then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether what was said of a drift no longer holds: another rule found it, or it left the 95 % interval of then."""
    drift, low, high = now.get("drift"), then.get("low"), then.get("high")
    if drift is None or low is None or high is None or then.get("rule") != now.get("rule"):
        return then != now
    return not low <= drift <= high
