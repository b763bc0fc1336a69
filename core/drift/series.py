"""What was measured of one quantity, event after event?"""

from dataclasses import dataclass
from datetime import datetime
from math import isfinite

from core.errors import RecordError


@dataclass(frozen=True, slots=True)
class Observation:
    """One value of a quantity: of a cycle, or of a whole event. An event may have several."""

    event: int
    """Which event it was measured in; any number that no other event has."""
    time: datetime
    """Aware, of the cycle's middle or the event's start; the cycles of an event are told apart by it."""
    value: float
    """SI units; of a quantity whose logarithm is watched, positive."""
    std: float
    """In the same unit."""
    amplitude: float | None = None
    """m for the isolation layer, m or m/s² for the superstructure; None where the quantity has none."""
    temperature: float | None = None
    """°C, None where it was not measured."""

    def __post_init__(self) -> None:
        numbers = (self.value, self.std, self.amplitude or 0.0, self.temperature or 0.0)
        if not all(isfinite(number) for number in numbers) or self.std < 0:
            raise RecordError(
                f"an observation of event {self.event} has numbers that are none: {numbers}; leave it out"
            )
        if self.time.tzinfo is None:
            raise RecordError(f"the time {self.time} of event {self.event} says no time zone; give one")


@dataclass(frozen=True, slots=True)
class Series:
    """One quantity of one thing over the years."""

    quantity: str
    """Name of a quantity of `core.drift.watched.QUANTITIES`."""
    subject: str
    """What it is of: a direction, a mode or a channel."""
    observations: tuple[Observation, ...]
    """In any order; the same one twice counts once."""
