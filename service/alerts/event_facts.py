"""What is known of an event, and of the alerts that it raised, that people may be told?"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from service.alerts.states import CLOSED, ON_HOLD, STANDING
from service.verdict.assessment import Assessment


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertFacts:
    """An alert, as far as people are told of it."""

    id: int
    cause: str
    kind: str
    state: str
    summary: str
    sentences: tuple[str, ...]
    evidence: Mapping[str, Any]
    began_at: datetime
    changed_after: datetime | None = None
    """Start of the last event that did not show it; None of what goes by the clock."""
    changed_by: datetime | None = None
    """Start of the first event that surely did."""
    end: str = ""
    """Why it ended, by whom; empty as long as it is open."""
    silenced_until: datetime | None = None
    """Local time; None where people are told."""
    silence_reason: str = ""

    @property
    def standing(self) -> str:
        """What its state comes to for those who are told; that somebody has taken it on is no news."""
        return "stands" if self.state in STANDING else "held back" if self.is_held_back else self.state

    @property
    def is_news(self) -> bool:
        """Whether it stands, and people are told."""
        return self.state in STANDING and self.silenced_until is None

    @property
    def is_silenced(self) -> bool:
        """Whether it stands, and people are not told."""
        return self.state in STANDING and self.silenced_until is not None

    @property
    def is_held_back(self) -> bool:
        """Whether a sensor may explain it."""
        return self.state == ON_HOLD

    @property
    def has_ended(self) -> bool:
        """Whether it was settled or withdrawn."""
        return self.state in CLOSED


@dataclass(frozen=True, slots=True, kw_only=True)
class EventFacts:
    """An event, as far as people are told of it; SI units, times in the building's zone."""

    id: int
    building_id: int
    code: str
    name: str
    start: datetime
    end: datetime
    refusal: str | None
    """Why nothing can be said of it; None where it was analysed."""
    pga: float | None
    """m/s²."""
    displacements: Mapping[str, float]
    """m, the isolators' largest, by direction."""
    resultant: float | None
    """m, the largest in plan."""
    residuals: Mapping[str, tuple[float, float | None]]
    """m, by direction, where a transducer measured it: value and standard deviation, None where that is unknown."""
    forces: Mapping[str, float]
    """N, by direction."""
    assessment: Assessment
    """The verdict on it."""
    alerts: tuple[AlertFacts, ...]
    """That people are told of with it, the gravest first; of those that have ended only what they were told of."""
    moved: tuple[AlertFacts, ...]
    """Of which people were told with this event, and are told with another one now."""

    @property
    def largest(self) -> float | None:
        """m, the isolators' largest displacement; None where nothing measured it."""
        return max(self.displacements.values(), default=None) if self.resultant is None else self.resultant
