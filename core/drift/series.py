"""Series of measurements of one quantity over the years, and the same as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import isfinite

import numpy as np

from core.arrays import Indices, Mask, Vector
from core.drift.quantities import Quantity, quantity
from core.errors import RecordError

YEAR = 365.2425 * 86400.0
"""s, mean length of the Gregorian year."""
LARGEST_RELATIVE_STD = 0.5
"""Standard deviation over value from which on the logarithm of a measurement cannot be trusted and is left out.
A choice: at 50 % the logarithm is no longer nearly normal."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """One value of a quantity, from a cycle or from a whole event. An event may have several."""

    event: int
    """Identifier of the event, unique among the events of the series."""
    time: datetime
    """Middle of the cycle, or start of the event, aware."""
    value: float
    """SI units; positive where the logarithm is monitored."""
    std: float
    """Standard deviation in the unit of the value."""
    amplitude: float | None = None
    """m for the isolation layer, m or m/s² for the superstructure; None where the quantity has none."""
    temperature: float | None = None
    """°C; None where it was not measured."""

    def __post_init__(self) -> None:
        numbers = (self.value, self.std, self.amplitude or 0.0, self.temperature or 0.0)
        if not all(isfinite(number) for number in numbers) or self.std < 0:
            raise RecordError(
                f"a measurement of event {self.event} has a number that is not finite, or a negative standard "
                f"deviation: {numbers}; leave it out"
            )
        if self.time.tzinfo is None:
            raise RecordError(f"the time {self.time} of event {self.event} has no time zone; add one")


@dataclass(frozen=True, slots=True)
class Series:
    """Measurements of one quantity of one direction, mode or channel."""

    quantity: str
    """Key of `core.drift.quantities.QUANTITIES`."""
    subject: str
    """Direction, mode or channel that was measured."""
    measurements: tuple[Measurement, ...]
    """In any order; duplicates count once."""


@dataclass(frozen=True, slots=True, eq=False)
class SeriesArrays:
    """n measurements as arrays, sorted by event and time."""

    event: Indices
    """(n,) index into the events of the series."""
    time: Vector
    """(n,) s since 1970-01-01 UTC."""
    value: Vector
    """(n,) natural logarithm of SI units where the logarithm is monitored, else SI units."""
    variance: Vector
    """(n,) variance of the value from its own measurement."""
    amplitude: Vector
    """(n,) natural logarithm of SI units; 0 where the quantity does not follow amplitude."""
    temperature: Vector
    """(n,) °C, NaN where it was not measured."""

    @property
    def season(self) -> Vector:
        """(n,) rad, phase of the year: 2π per year."""
        return 2 * np.pi * self.time / YEAR

    def subset(self, which: Mask | Indices) -> "SeriesArrays":
        """The measurements selected by a mask or by indices."""
        return SeriesArrays(
            self.event[which],
            self.time[which],
            self.value[which],
            self.variance[which],
            self.amplitude[which],
            self.temperature[which],
        )


@dataclass(frozen=True, slots=True)
class SeriesEvent:
    """One event of a series."""

    event: int
    """Identifier, as in `Measurement.event`."""
    time: datetime
    """Time of its first measurement, aware."""


def series_arrays(series: Series) -> tuple[SeriesArrays, tuple[SeriesEvent, ...]]:
    """The usable measurements of a series as arrays, and their events in order of time.

    Duplicates count once. Measurements without the amplitude that their quantity follows are left out. Where the
    logarithm is monitored, so are values that are not positive or whose standard deviation is
    `LARGEST_RELATIVE_STD` of them or more. The order of arrival does not matter.

    Raises:
        ModelError: the quantity of the series is not monitored.
    """
    known = quantity(series.quantity)
    usable = [one for one in set(series.measurements) if _is_usable(one, known)]
    events = _events(usable)
    place = {event.event: n for n, event in enumerate(events)}
    # The values break ties of time, so that the order of arrival does not even change the rounding.
    usable.sort(key=lambda one: (place[one.event], one.time, one.value, one.std, one.amplitude or 0.0))
    value, std, amplitude = (
        np.array([getattr(one, name) or 0.0 for one in usable]) for name in ("value", "std", "amplitude")
    )
    arrays = SeriesArrays(
        event=np.array([place[one.event] for one in usable], dtype=np.intp),
        time=np.array([one.time.timestamp() for one in usable]),
        value=np.log(value) if known.is_logarithmic else value,
        variance=(std / value) ** 2 if known.is_logarithmic else std**2,
        amplitude=np.log(amplitude) if known.follows_amplitude else np.zeros(len(usable)),
        temperature=np.array([np.nan if one.temperature is None else one.temperature for one in usable]),
    )
    return arrays, events


def _events(measurements: Sequence[Measurement]) -> tuple[SeriesEvent, ...]:
    first: dict[int, datetime] = {}
    for one in measurements:
        first[one.event] = min(one.time, first.get(one.event, one.time))
    return tuple(SeriesEvent(event, time) for event, time in sorted(first.items(), key=lambda pair: (pair[1], pair[0])))


def _is_usable(one: Measurement, known: Quantity) -> bool:
    if known.follows_amplitude and not (one.amplitude is not None and one.amplitude > 0):
        return False
    return not known.is_logarithmic or (one.value > 0 and one.std < LARGEST_RELATIVE_STD * one.value)
