"""Does a channel's level go on changing where the building is at rest? Then its sensor drifts.

A layer stays where an earthquake leaves it: before the motion and after it the level of its displacement is constant,
though the level after may be another; that of an acceleration is the same always. The level of every few seconds is
uncertain by what still moves there.
"""

from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from core.arrays import Matrix, Vector

BLOCK = 5.0
"""s, of one level."""
SWAY = 0.2
"""Of a block's standard deviation: the mean of 5 s of motion at 0.5 Hz reaches at most √2 / (5 · 0.5 π) of it."""
RESOLUTION = 1e-5
"""m, or m/s², of a good sensor: no level is known better."""
QUIET = 0.1
"""Of the standard deviation of the block that moves most: a block that moves less is taken for rest."""


@dataclass(frozen=True, slots=True)
class Creep:
    """Between the two levels of one time at rest that differ most certainly."""

    change: float
    """m or m/s², from the earlier to the later."""
    std: float
    """In the same unit."""
    share: float
    """Of the record's largest value, without sign."""


def creep(samples: Vector, rate: float) -> Creep | None:
    """By how much the level changed at rest; None where the record holds no two successive blocks at rest.

    Args:
        samples: (n,) m of a transducer across the layer, or m/s².
        rate: Hz.
    """
    length = round(BLOCK * rate)
    blocks = samples[: samples.size // length * length].reshape(-1, length)
    levels, moving = blocks.mean(axis=1), _about_their_trend(blocks)
    std = SWAY * moving + RESOLUTION
    quiet = moving < QUIET * moving.max(initial=0.0)
    changes = [
        (float(levels[later] - levels[earlier]), float(np.hypot(std[earlier], std[later])))
        for first, end in _runs(quiet)
        for earlier, later in combinations(range(first, end), 2)
    ]
    if not changes:
        return None
    change, error = max(changes, key=lambda pair: abs(pair[0]) / pair[1])
    return Creep(change, error, abs(change) / float(np.abs(samples).max()))


def _about_their_trend(blocks: Matrix) -> Vector:
    """(blocks,) standard deviation of each about its straight line."""
    time = np.linspace(-1.0, 1.0, blocks.shape[1])
    centred = blocks - blocks.mean(axis=1, keepdims=True)
    return np.asarray((centred - np.outer(centred @ time / (time @ time), time)).std(axis=1))


def _runs(quiet: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[int, int]]:
    """First and one past the last block of each time at rest."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]])))
    return [(int(first), int(end)) for first, end in list(pairwise(edges))[::2]]
