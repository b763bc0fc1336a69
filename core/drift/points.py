"""Observations as arrays: which event, which value, under which circumstances?"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from core.arrays import Indices, Mask, Vector
from core.drift.series import Observation, Series
from core.drift.watched import Quantity, quantity

YEAR = 365.2425 * 86400.0
"""s"""
UNDETERMINED = 0.5
"""Of its value: an observation of larger standard deviation has no logarithm that could be trusted."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """(n,) observations in order of time, each with its event."""

    event: Indices
    """(n,) index into the events."""
    time: Vector
    """(n,) s since 1970."""
    value: Vector
    """(n,) natural logarithm of SI units, or SI units."""
    variance: Vector
    """(n,) of the value, of its own measurement."""
    amplitude: Vector
    """(n,) natural logarithm; 0 where the quantity follows none."""
    temperature: Vector
    """(n,) °C, NaN where it was not measured."""

    @property
    def season(self) -> Vector:
        """(n,) rad, 2π a year."""
        return 2 * np.pi * self.time / YEAR

    def chosen(self, which: Mask | Indices) -> "Points":
        """Some of them."""
        return Points(
            self.event[which],
            self.time[which],
            self.value[which],
            self.variance[which],
            self.amplitude[which],
            self.temperature[which],
        )


@dataclass(frozen=True, slots=True)
class Dated:
    """An event of a series."""

    event: int
    time: datetime
    """Of its first observation."""


def _dated(observations: Sequence[Observation]) -> tuple[Dated, ...]:
    first: dict[int, datetime] = {}
    for one in observations:
        first[one.event] = min(one.time, first.get(one.event, one.time))
    return tuple(Dated(event, time) for event, time in sorted(first.items(), key=lambda pair: (pair[1], pair[0])))


def points(series: Series) -> tuple[Points, tuple[Dated, ...]]:
    """What can be used of a series, and the events that it is from in order of time.

    The same observation twice counts once. Where logarithms are watched, values that are not positive and values
    with a standard deviation of more than half of them are left out, and so are observations without the amplitude
    that their quantity follows.
    """
    known = quantity(series.quantity)
    usable = [one for one in set(series.observations) if _is_usable(one, known)]
    events = _dated(usable)
    place = {dated.event: n for n, dated in enumerate(events)}
    # The values break ties of time, so that the order of arrival decides nothing, not even a rounding.
    usable.sort(key=lambda one: (place[one.event], one.time, one.value, one.std, one.amplitude or 0.0))
    value, std, amplitude = (
        np.array([getattr(one, name) or 0.0 for one in usable]) for name in ("value", "std", "amplitude")
    )
    found = Points(
        event=np.array([place[one.event] for one in usable], dtype=np.intp),
        time=np.array([one.time.timestamp() for one in usable]),
        value=np.log(value) if known.is_logarithmic else value,
        variance=(std / value) ** 2 if known.is_logarithmic else std**2,
        amplitude=np.log(amplitude) if known.follows_amplitude else np.zeros(len(usable)),
        temperature=np.array([np.nan if one.temperature is None else one.temperature for one in usable]),
    )
    return found, events


def _is_usable(one: Observation, known: Quantity) -> bool:
    if known.follows_amplitude and not (one.amplitude is not None and one.amplitude > 0):
        return False
    return not known.is_logarithmic or (one.value > 0 and one.std < UNDETERMINED * one.value)
