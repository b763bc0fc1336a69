"""The motion that a model is driven along, and what else acts on the layer, at every moment."""

from dataclasses import dataclass
from functools import cache
from math import ceil

import numpy as np

from core.arrays import Matrix, Vector
from core.errors import ModelError
from core.model.isolator import Conditions

LONGEST_STEP = 1e-2
"""s, of whoever integrates along a path."""
HALVED = 2
"""Times that a step may be halved where a law asks for it."""


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Motion and conditions, cubic between samples, with the slopes of Catmull and Rom (1974)."""

    samples: Matrix
    """(n + 3, 7) u, v and the conditions' rows, from one before the first sample to two after the last."""
    acceleration: Vector
    """(n,) m/s², of the layer."""
    weights: Matrix
    """(2 * steps + 1, 4) of four neighbouring samples, at the ends and the middle of each of the shortest steps."""
    interval: float
    """s, between samples."""
    least: int
    """Steps in it, at least."""


def path(
    displacement: Vector,
    velocity: Vector,
    rate: float,
    conditions: Conditions | None = None,
    substeps: int | None = None,
) -> Path:
    """Of a motion.

    Args:
        displacement: (n,) m, n at least 2.
        velocity: (n,) m/s.
        rate: Hz.
        conditions: None for the usual ones.
        substeps: per sample, never more nor less; None for those that keep to LONGEST_STEP, and HALVED.

    Raises:
        ModelError: what is given differs in length.
    """
    given = conditions or Conditions.usual(displacement.size, rate)
    if not displacement.shape == velocity.shape == given.time.shape or displacement.size < 2:
        raise ModelError(
            f"displacement {displacement.shape}, velocity {velocity.shape} and conditions {given.time.shape} must be "
            "alike vectors of two samples or more"
        )
    least = substeps or ceil(1 / (rate * LONGEST_STEP) - 1e-9)
    weights = _weights(substeps or least * 2**HALVED)
    return Path(_extended(displacement, velocity, given), _acceleration(velocity, rate), weights, 1 / rate, least)


def _extended(displacement: Vector, velocity: Vector, given: Conditions) -> Matrix:
    samples = np.empty((displacement.size + 3, 7))
    samples[1:-2, 0], samples[1:-2, 1], samples[1:-2, 2:] = displacement, velocity, given.rows
    samples[0] = 2 * samples[1] - samples[2]
    samples[-2:] = 2 * samples[-3] - samples[-4]
    return samples


def _acceleration(velocity: Vector, rate: float) -> Vector:
    """Of fourth order between five neighbours, of second at the ends."""
    if velocity.size < 5:
        return np.gradient(velocity, 1 / rate)
    found = np.gradient(velocity, 1 / rate, edge_order=2)
    wide = (velocity[4:] - velocity[:-4]) / (4 / rate)
    found[2:-2] = (4 * found[2:-2] - wide) / 3
    return found


@cache
def _weights(substeps: int) -> Matrix:
    t = np.linspace(0, 1, 2 * substeps + 1)
    return 0.5 * np.column_stack(
        [t * (t * (2 - t) - 1), t * t * (3 * t - 5) + 2, t * (t * (4 - 3 * t) + 1), t * t * (t - 1)]
    )
