"""What is a rule's alarm, with its evidence?"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Alarm:
    """A change that a rule found."""

    rule: str
    """`sudden`, `slow`, `recovery` or `within` (damage within one event)."""
    is_sure: bool
    """False while evidence gathers."""
    onset: int
    """Event with which the change most likely began."""
    after: int
    """The last event that did not show it, and"""
    by: int
    """the first that did, with 95 %; the same event where the change happened within it."""
    raised: int
    """Event at which the rule was sure; of one that is not yet, the latest event."""
    events: tuple[int, ...]
    """Whose evidence raised it, those that the rule judged; with the onset."""
    drift: float
    """Relative, -0.08 for 8 % less; in SI units where no logarithm is watched. Of a slow change, until the latest
    event that belongs to it."""
    low: float
    high: float
    """95 % interval of the drift, given the onset."""
    false_alarms: float
    """Share of sequences of 100 healthy events in which the rule alarms."""
    causes: tuple[str, ...]
    """What else could explain it, for people."""
    message: str
    """For an engineer."""
