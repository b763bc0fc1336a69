"""Samples of sensors, in SI units: segments as recorded, traces of one channel, and records of all channels."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Literal

from core.errors import RecordError

if TYPE_CHECKING:  # NumPy takes long to import, and a description of channels has no samples
    from core.arrays import Matrix, Vector

Direction = Literal["x", "y", "z"]
Quantity = Literal["acceleration", "velocity", "displacement", "temperature"]
Severity = Literal["note", "warning", "fatal"]
"""`note`: mended or harmless; `warning`: the results may be affected; `fatal`: its direction is left out. An event
without any direction is rejected."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One sensor component: its place and the quantity that it measures."""

    id: str
    """Network, station, location and channel code, as in `XX.BNCS.01.HNX`."""
    level: str
    quantity: Quantity
    """Accelerations are absolute; displacements are of the level relative to the ground; temperature in °C."""
    direction: Direction | None = None
    """None for a temperature."""
    position: tuple[float, float] | None = None
    """m, x and y of the sensor relative to the level's centre of mass; None if not given."""
    rotation: float = 0.0
    """rad, of the sensor's axes relative to the building's, from x towards y."""


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """An unbroken piece of one channel, as it was recorded."""

    channel: str
    """Id of the channel."""
    start: datetime
    """Time of the first sample, aware."""
    rate: float
    """Hz."""
    samples: "Vector"
    """(n,) SI units."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """All samples of one channel at its own rate."""

    start: datetime
    """Time of the first sample, aware."""
    rate: float
    """Hz."""
    samples: "Vector"
    """(n,) SI units; NaN where nothing was recorded."""

    @property
    def end(self) -> datetime:
        """Time of the last sample."""
        return self.start + timedelta(seconds=(self.samples.size - 1) / self.rate)


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Samples of all channels on one time base."""

    start: datetime
    """Time of the first sample, aware."""
    rate: float
    """Hz."""
    channels: tuple[Channel, ...]
    samples: "Matrix"
    """(channels, n) SI units; NaN where nothing was recorded."""

    def __post_init__(self) -> None:
        if self.samples.ndim != 2 or self.samples.shape[0] != len(self.channels):
            raise RecordError(f"samples of shape {self.samples.shape} do not fit {len(self.channels)} channels")
        if not self.rate > 0:
            raise RecordError(f"the sampling rate must be positive, got {self.rate} Hz")
        if self.start.tzinfo is None:
            raise RecordError(f"the start {self.start} has no time zone; give one, such as UTC")

    @property
    def time(self) -> "Vector":
        """(n,) s since the start."""
        import numpy as np

        return np.arange(self.samples.shape[1]) / self.rate

    def find(self, level: str, quantity: Quantity, direction: Direction | None) -> "Vector | None":
        """(n,) samples of the first such channel, or None if the record has none."""
        for channel, samples in zip(self.channels, self.samples, strict=True):
            if (channel.level, channel.quantity, channel.direction) == (level, quantity, direction):
                return samples
        return None


@dataclass(frozen=True, slots=True)
class Finding:
    """One data quality finding."""

    kind: str
    """Kind of the finding, one word that programs may rely on: `gap`, `spike`, `clipping`, `dead`, `swapped`, ..."""
    severity: Severity
    message: str
    """For an engineer: the problem, with its number and unit, and what helps."""
    channel: str | None = None
    value: float | None = None
    """The finding's number in SI units, if it has one."""
