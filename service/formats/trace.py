"""What a file of records holds, whatever its format."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

import numpy as np

from core.arrays import Vector
from core.record import Quantity, Segment
from service.formats.errors import FormatError
from service.formats.units import Gain

Numbers = np.ndarray[tuple[int], np.dtype[np.int32 | np.float32 | np.float64]]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """An unbroken piece of one channel, in the file's own numbers, and what they mean."""

    channel: str
    """Network, station, location and channel code: docs/operate/formats.md tells how each format's ids are made."""
    start: datetime
    """Time of the first sample, UTC."""
    rate: float
    """Hz."""
    numbers: Numbers
    """(n,) as stored; int32, float32 or float64."""
    gain: float
    """SI units per number."""
    quantity: Quantity
    sensor: str = ""
    """What the file says of the sensor's place and orientation."""

    def __post_init__(self) -> None:
        if self.numbers.dtype not in (np.int32, np.float32, np.float64):
            raise FormatError(f"samples of {self.channel} are {self.numbers.dtype}; integers or floats would do")
        if not self.rate > 0:
            raise FormatError(f"the sampling rate of {self.channel} is {self.rate} Hz; it must be above 0")
        finite = np.isfinite(self.numbers)
        if not finite.all():
            raise FormatError(
                f"{np.count_nonzero(~finite)} of {finite.size} samples of {self.channel} are not numbers, the first "
                f"at sample {np.argmin(finite) + 1}; where nothing was recorded the file must have a gap"
            )

    def to_si(self) -> Vector:
        """(n,) samples in SI units."""
        return self.numbers.astype(np.float64) * self.gain

    def segment(self) -> Segment:
        """The trace in SI units, as core takes it."""
        return Segment(self.channel, self.start, self.rate, self.to_si())


@dataclass(frozen=True, slots=True)
class Contents:
    """What a file holds."""

    kind: Literal["waveforms", "station"]
    """`station`: gains only."""
    traces: tuple[Trace, ...] = ()
    gains: Mapping[str, Gain] = field(default_factory=dict)
    """By channel id, from StationXML."""
    without_unit: tuple[str, ...] = ()
    """Ids of channels left out of `traces` because nothing says what their numbers are, yet."""
    remarks: tuple[str, ...] = ()
    """What else was left out and why."""
