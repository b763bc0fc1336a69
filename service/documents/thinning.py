"""Thinning of long series for pictures that keeps peaks and the shapes of loops."""

import numpy as np

from core.arrays import Indices, Vector

FEWEST = 4
"""The first and the last sample, and the extremes of what lies between."""


def extremes(values: Vector, points: int) -> Indices:
    """Indices of at most `points` samples that look like all: the first, the last and each pixel's extremes.

    Args:
        values: (n,) any unit; NaN is never an extreme unless a pixel holds nothing else.
        points: at least FEWEST.

    Returns:
        (at most points,) increasing; all n where they are no more than `points`.

    Raises:
        ValueError: fewer points than FEWEST.
    """
    if points < FEWEST:
        raise ValueError(f"a series cannot be thinned to {points} points; {FEWEST} or more are needed")
    if values.size <= points:
        return np.arange(values.size)
    pixels = (points - 2) // 2
    width = -(-values.size // pixels)
    lowest = _by_pixel(np.where(np.isnan(values), np.inf, values), width, np.inf).argmin(axis=1)
    highest = _by_pixel(np.where(np.isnan(values), -np.inf, values), width, -np.inf).argmax(axis=1)
    first = np.arange(lowest.size) * width
    return np.unique(np.concatenate([[0], first + lowest, first + highest, [values.size - 1]]))


def _by_pixel(values: Vector, width: int, padding: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """(pixels, width) with the last pixel padded."""
    return np.pad(values, (0, -values.size % width), constant_values=padding).reshape(-1, width)


def along_path(x: Vector, y: Vector, step: float) -> Indices:
    """Indices of the samples that a plane curve needs: one for each step of its own length.

    A curve's extremes by time would cut the corners of a loop; this keeps its shape at any speed.

    Args:
        x: (n,) any unit, finite.
        y: (n,) any unit, finite.
        step: as a part of the width and the height of the picture.

    Returns:
        (n or fewer,) increasing, the first and the last among them.
    """
    across, up = (np.diff(values) / (np.ptp(values) or 1.0) for values in (x, y))
    length = np.concatenate([[0.0], np.cumsum(np.hypot(across, up))])
    kept = np.unique(np.floor(length / step), return_index=True)[1]
    return np.union1d(kept, [x.size - 1])
