"""What is found of a building that people should know, before anybody was told of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

Kind = Literal["deterioration", "limit", "recovery", "sensor", "model", "data"]
"""What the isolators lost, a limit that they exceeded, what they won, a sensor that measures wrongly, a model that fits
no more, data that stopped."""
Scope = Literal["events", "clock"]
"""Who found it: the rules over all of a building's earthquakes, or the checks that go by the clock."""
KINDS: Mapping[Scope, frozenset[Kind]] = {
    "events": frozenset({"deterioration", "limit", "recovery", "sensor", "model"}),
    "clock": frozenset({"data"}),
}
"""Which of them a scope is all about: what it does not list of these kinds is not so any more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """One thing that is so as far as the stored results tell now; at most one of a cause."""

    cause: str
    """What it is about: `stiffness/x`, `frequency/x/1`, `gain/XX.DEMO.01.HNX`, `model/x`, `source`, `disk`, ..."""
    kind: Kind
    is_sure: bool
    """Whether there is evidence enough to tell people; else it is still gathering."""
    began_at: datetime
    """Since when it is so: the start of the first event that shows it, or what the clock says."""
    raised_at: datetime
    """When there was evidence enough: the start of the event that brought it, or what the clock says."""
    onset_event_id: int | None = None
    """First event that shows it; None of what goes by the clock."""
    raised_event_id: int | None = None
    """Event that brought evidence enough; the message about that event tells of it."""
    changed_after: datetime | None = None
    """Start of the last event that did not show it; None of what goes by the clock."""
    changed_by: datetime | None = None
    """Start of the first event that surely did."""
    event_ids: tuple[int, ...] = ()
    """Events that triggered it, in the order of time."""
    channels: tuple[str, ...] = ()
    """Of a sensor's finding those that are wrong; of any other those that it is found with."""
    evidence: Mapping[str, Any]
    """JSON values in SI units; `drift`, `low` and `high` (95 %) where it has a size: from these it is told when it got
    worse."""
    summary: str
    """One line for somebody who is no engineer, without an end: `The isolators are 8 % softer in direction x`."""
    sentences: tuple[str, ...]
    """More of it, first for everybody, then the numbers for the engineer."""
    dated: str = ""
    """When it began, one sentence; of what is found in several directions each part has its own."""
