"""The expected value of a series over amplitude, with its band, in SI units."""

from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.drift.baseline import Baseline

BAND = 1.96
"""Standard deviations, within which 95 % of a normal variable lie."""
BEYOND = 1.5
"""Factor by which the curve is drawn beyond the amplitudes that the reference holds: the band widens there."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """On a grid of amplitudes."""

    amplitude: Vector | None
    """(n,) m, or N for frequencies; None where the quantity follows none: n is 1."""
    expected: Vector
    """(n,) in SI units of the quantity."""
    low: Vector
    high: Vector
    """(n,) ends of the band in which an event's value lies with 95 %."""
    is_seen: Vector
    """(n,) 1 where the reference holds such amplitudes."""
    temperature: float | None
    """°C, at which it holds; None where the temperature has no known influence."""


def curve(baseline: Baseline, temperature: float | None, points: int) -> Curve:
    """The curve at so many amplitudes, evenly spaced by their logarithm.

    Args:
        baseline: of the series.
        temperature: °C; None: the mean of the reference.
        points: of the grid, two at least.
    """
    mean = baseline.model.temperature
    at = None if mean is None else mean if temperature is None else temperature
    seen = baseline.range
    if seen is None:
        amplitude = np.ones(1)
        is_seen = np.ones(1)
    else:
        amplitude = np.geomspace(seen[0] / BEYOND, seen[1] * BEYOND, points)
        is_seen = ((amplitude >= seen[0]) & (amplitude <= seen[1])).astype(float)
    middle, std = baseline.expected(amplitude, at)
    ends = (middle, middle - BAND * std, middle + BAND * std)
    is_logarithmic = baseline.model.quantity.is_logarithmic
    expected, low, high = (np.exp(one) if is_logarithmic else one for one in ends)
    return Curve(None if seen is None else amplitude, expected, low, high, is_seen, at)
