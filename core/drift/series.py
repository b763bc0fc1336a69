"""Series of measurements of one quantity over the years, and the same as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from typing import Self, overload

import numpy as np

from core.arrays import Indices, Mask, Vector
from core.drift.quantities import Quantity, quantity
from core.errors import RecordError
from core.rounding import plain
from core.tables import report
from core.units import percent, shown, unit

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


@dataclass(frozen=True, slots=True, eq=False)
class MeasurementColumns(Sequence[Measurement]):
    """n measurements as columns. Years of cycles are read so, because as many objects take ten times as long."""

    event: Indices
    """(n,) identifier of the event."""
    time: Vector
    """(n,) s since 1970-01-01 UTC."""
    value: Vector
    """(n,) SI units."""
    std: Vector
    """(n,) standard deviation of the value."""
    amplitude: Vector
    """(n,) NaN where the quantity has none."""
    temperature: Vector
    """(n,) °C, NaN where it was not measured."""

    @classmethod
    def of(cls, measurements: Sequence[Measurement]) -> Self:
        """The columns of some measurements."""

        def column(name: str) -> Vector:
            return np.array([getattr(one, name) for one in measurements], dtype=float)

        return cls(
            event=np.array([one.event for one in measurements], dtype=np.intp),
            time=np.array([one.time.timestamp() for one in measurements], dtype=float),
            value=column("value"),
            std=column("std"),
            amplitude=column("amplitude"),
            temperature=column("temperature"),
        )

    def subset(self, which: Mask | Indices) -> Self:
        """The measurements selected by a mask or by indices."""
        return type(self)(
            self.event[which],
            self.time[which],
            self.value[which],
            self.std[which],
            self.amplitude[which],
            self.temperature[which],
        )

    def __len__(self) -> int:
        return int(self.event.size)

    @overload
    def __getitem__(self, place: int) -> Measurement: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Measurement, ...]: ...
    def __getitem__(self, place: int | slice) -> Measurement | tuple[Measurement, ...]:
        if isinstance(place, slice):
            return tuple(self[n] for n in range(*place.indices(len(self))))
        amplitude, temperature = float(self.amplitude[place]), float(self.temperature[place])
        return Measurement(
            event=int(self.event[place]),
            time=datetime.fromtimestamp(float(self.time[place]), UTC),
            value=float(self.value[place]),
            std=float(self.std[place]),
            amplitude=None if np.isnan(amplitude) else amplitude,
            temperature=None if np.isnan(temperature) else temperature,
        )


@dataclass(frozen=True, slots=True)
class Series:
    """Measurements of one quantity of one direction, mode or channel."""

    quantity: str
    """Key of `core.drift.quantities.QUANTITIES`."""
    subject: str
    """Direction, mode or channel that was measured."""
    measurements: Sequence[Measurement]
    """In any order; duplicates count once. Years of cycles are MeasurementColumns."""

    def __str__(self) -> str:
        known, count = quantity(self.quantity), len(self.measurements)
        title = f"Series of the {known.title}, {self.subject}"
        if not count:
            return report(title, ["There is no measurement."])
        columns = MeasurementColumns.of(self.measurements)
        first, last = (
            f"{datetime.fromtimestamp(one, UTC):%Y-%m-%d}" for one in (columns.time.min(), columns.time.max())
        )
        low, median, high = (float(np.quantile(columns.value, share)) for share in (0.0, 0.5, 1.0))
        if known.is_logarithmic:
            below, above = percent(1 - low / median), percent(high / median - 1)
            spread = f"The smallest is {below} below the median, the largest {above} above it."
        else:
            spread = f"The smallest is {_length(low)}, the largest {_length(high)}."
        sentences = [
            f"{count} measurements in {np.unique(columns.event).size} events, from {first} to {last}.",
            spread,
        ]
        return report(title, sentences)


def _length(value: float) -> str:
    return f"{plain(shown(value, 'm'), 2)} {unit('m')}"


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
    known, given = quantity(series.quantity), series.measurements
    rows = given if isinstance(given, MeasurementColumns) else MeasurementColumns.of(given)
    usable = rows.subset(_is_usable(rows, known))
    events, place = _events(usable)
    # The values break ties of time, so that the order of arrival does not even change the rounding.
    keys = (usable.temperature, usable.amplitude, usable.std, usable.value, usable.time, place)
    order = np.lexsort(keys)
    is_first = np.ones(order.size, dtype=bool)
    is_first[1:] = np.any([~_is_same(one[order][1:], one[order][:-1]) for one in keys], axis=0)
    kept = order[is_first]
    own = usable.subset(kept)
    arrays = SeriesArrays(
        event=place[kept],
        time=own.time,
        value=np.log(own.value) if known.is_logarithmic else own.value,
        variance=(own.std / own.value) ** 2 if known.is_logarithmic else own.std**2,
        amplitude=np.log(own.amplitude) if known.follows_amplitude else np.zeros(kept.size),
        temperature=own.temperature,
    )
    return arrays, events


def _events(rows: MeasurementColumns) -> tuple[tuple[SeriesEvent, ...], Indices]:
    """The events in order of time, and (n,) the index of each measurement's event."""
    numbers, own = np.unique(rows.event, return_inverse=True)
    first = np.full(numbers.size, np.inf)
    np.minimum.at(first, own, rows.time)
    order = np.lexsort((numbers, first))
    place = np.empty(numbers.size, dtype=np.intp)
    place[order] = np.arange(numbers.size)
    times = (datetime.fromtimestamp(time, UTC) for time in first[order].tolist())
    return tuple(SeriesEvent(*one) for one in zip(numbers[order].tolist(), times, strict=True)), place[own]


def _is_usable(rows: MeasurementColumns, known: Quantity) -> Mask:
    usable = np.ones(len(rows), dtype=bool)
    if known.follows_amplitude:
        usable &= rows.amplitude > 0  # false for NaN
    if known.is_logarithmic:
        usable &= (rows.value > 0) & (rows.std < LARGEST_RELATIVE_STD * rows.value)
    return usable


def _is_same(one: Vector | Indices, other: Vector | Indices) -> Mask:
    """(n,) whether the numbers are the same, or both missing."""
    return np.asarray((one == other) | (np.isnan(one) & np.isnan(other)))
