"""Does a channel lie flat at its sensor's limit?

A smooth motion that turns within a run of samples falls, from the middle of the run to its ends, by what its
curvature makes of that time. Equal samples at the largest value are therefore only coarse where that is no more than
a few steps of the digitiser, and clipped where it is more. Besides, a finely resolved motion does not come to
the very same largest value time and again.
"""

import numpy as np

from core.arrays import Vector

RUN = 3
"""Samples in a row at a channel's largest value, of which no analogue signal is capable."""
RESOLVED = 50
"""Steps of the digitiser within the largest value, below which a run of equal samples is only coarse."""
HIDDEN = 5.0
"""Steps of the digitiser by which a motion may fall within a run of equal samples, the sensor's own noise being one."""
VISITS = 3
"""Separate peaks that end at the very same value, of which a finely resolved motion is not capable either."""
FINE = 1e4
"""Steps of the digitiser within the largest value, from which on peaks of equal height are no matter of resolution."""
APART = 0.9
"""Of the largest value: between two separate peaks the channel falls below that."""
SHARE = 0.2
"""Of the channel's whole range that lies on the side of a limit."""
SMALLEST_STEPS = 0.01
"""Share of the changes from sample to sample that are smaller than a step of the digitiser, by mended samples."""


def clipped_samples(samples: Vector) -> int:
    """How many samples lie flat at the channel's largest or smallest value: 0 if it is not clipped.

    Args:
        samples: (n,) without NaN, about the channel's position at rest.
    """
    changes = np.abs(np.diff(samples))
    step = float(np.quantile(changes[changes > 0], SMALLEST_STEPS)) if changes.any() else np.inf
    upward = (samples, -samples)
    limits = (float(side.max()) for side in upward)
    return sum(
        _at_limit(side, limit, step)
        for side, limit in zip(upward, limits, strict=True)
        if limit > max(RESOLVED * step, SHARE * float(np.ptp(samples)))
    )


def _at_limit(samples: Vector, limit: float, step: float) -> int:
    """Samples at the upper limit, where they show that it is the sensor's."""
    there = samples >= limit - 1e-9 * limit
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(int), [0]]))).reshape(-1, 2)
    cut = any(
        stop - start >= RUN and _fall(samples, start, stop) > HIDDEN * step
        for start, stop in edges
        if start >= 2 and stop <= samples.size - 2
    )
    fallen = np.concatenate([[0], np.cumsum(samples < APART * limit)])
    visits = np.unique(fallen[edges[:, 0]]).size
    return int(there.sum()) if cut or (visits >= VISITS and limit > FINE * step) else 0


def _fall(samples: Vector, start: int, stop: int) -> float:
    """By how much a parabola falls within half of the run [start, stop) whose slopes are those just outside."""
    rise, fall = samples[start - 1] - samples[start - 2], samples[stop] - samples[stop + 1]
    length = stop - start
    curvature = (rise + fall) / (length + 2)
    return float(curvature * (length - 1) ** 2 / 8)
