"""What is suspected before the isolation layer is?"""

from dataclasses import dataclass
from enum import Enum


class Cause(Enum):
    """To what part of building and instruments a suspicion points."""

    SENSOR = "sensor_fault"
    SUPERSTRUCTURE = "superstructure"
    MASS = "mass"


@dataclass(frozen=True, slots=True)
class Suspect:
    """One thing that the records, taken together, say is not as described."""

    cause: Cause
    kind: str
    """What is wrong, one word that programs may rely on: `gain`, `delay`, `polarity`, `storey`, `mass`, ..."""
    channel: str | None
    """Id of the sensor's channel, or name of the floor above the storey; None for the mass."""
    value: float
    """By how much, in SI units; see the message."""
    std: float | None
    """Of the value; None where it has none, as for a polarity."""
    message: str
    """For an engineer: what was found, with its number and unit, and what would do."""
