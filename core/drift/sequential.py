"""How strongly does a sequence of deviations, up to each event, ask for a change at each onset?

The generalised likelihood ratio over onset and size (Lorden, 1971; Willsky and Jones, 1976) for deviations that share
the error of their baseline. Whitened by the Cholesky factor of their covariance they are innovations: each less what
those before it foretell. Their scale is known from the reference with so many degrees of freedom, which makes the ratio
one of Student's t. An innovation is clipped, so that one event alone cannot carry a change.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.stats import t as student

from core.arrays import Indices, Matrix, Vector

CLIP = 4.0
"""Standard deviations that an innovation counts at most when it is decided whether there is a change."""
LOCATING_CLIP = 8.0
"""The same when it is decided where a change began."""
SUPPORT = 1.5
"""Standard deviations by which an event must deviate to speak for a change."""
LEVEL = 0.95
"""Of the interval of a change."""


@dataclass(frozen=True, slots=True, eq=False)
class Innovations:
    """A whitened sequence."""

    lower: Matrix
    """(n, n) Cholesky factor of the covariance."""
    clipped: Vector
    """(n,)"""
    raw: Vector
    """(n,) with nothing clipped."""
    freedom: float
    """Degrees of freedom of the scale of the covariance."""


@dataclass(frozen=True, slots=True)
class Change:
    """A size of a pattern, and its interval."""

    size: float
    std: float
    low: float
    high: float


def innovations(deviation: Vector, covariance: Matrix, freedom: float, clip: float) -> Innovations:
    """Of (n,) deviations with (n, n) covariance; none counts for more than `clip` standard deviations."""
    lower = np.asarray(cholesky(covariance, lower=True))
    clipped = np.zeros(deviation.size)
    for n in range(deviation.size):  # what was clipped must not mislead the prediction of the next
        ahead = (deviation[n] - lower[n, :n] @ clipped[:n]) / lower[n, n]
        clipped[n] = np.clip(ahead, -clip, clip)
    return Innovations(lower, clipped, np.asarray(solve_triangular(lower, deviation, lower=True)), freedom)


def until(found: Innovations, count: int) -> Innovations:
    """Of the first `count` events alone."""
    return Innovations(found.lower[:count, :count], found.clipped[:count], found.raw[:count], found.freedom)


def whitened(found: Innovations, patterns: Matrix) -> Matrix:
    """(n, k) patterns as they show in the innovations."""
    return np.asarray(solve_triangular(found.lower, patterns, lower=True))


def evidence(found: Innovations, patterns: Matrix, sense: int) -> tuple[Matrix, Indices]:
    """Signed root of twice the log likelihood ratio.

    Args:
        found: n innovations.
        patterns: (n, onsets) of a change of one.
        sense: -1 for a fall, +1 for a rise; a change against it counts nothing.

    Returns:
        (n, onsets) by the latest event and the onset, and how many events speak for it.
    """
    white = whitened(found, patterns)
    z = found.clipped[:, None]
    along, length = np.cumsum(white * z, axis=0), np.cumsum(white**2, axis=0)
    explained = np.maximum(sense * along, 0.0) ** 2 / np.maximum(length, np.finfo(float).tiny)
    total = np.cumsum(z**2, axis=0)
    count = found.freedom + np.arange(1, z.size + 1)[:, None]
    root = np.sqrt(count * np.log((found.freedom + total) / (found.freedom + total - explained)))
    speaking = np.cumsum((sense * np.sign(white) * z > SUPPORT) & (patterns > 0), axis=0)
    return root, np.asarray(speaking)


def change(found: Innovations, pattern: Vector) -> Change:
    """The size of an (n,) pattern by robust least squares, and its interval by Student's t."""
    white = np.asarray(solve_triangular(found.lower, pattern, lower=True))
    weight = np.ones(white.size)
    for _ in range(3):
        size = float((weight * white) @ found.raw / ((weight * white) @ white))
        residual = found.raw - size * white
        weight = 1 / np.maximum(1.0, np.abs(residual) / CLIP)
    scale = (found.freedom + weight @ residual**2) / (found.freedom + white.size)
    std = float(np.sqrt(scale / ((weight * white) @ white)))
    # Most of the error is that of the level before, whose scatter the reference tells with so many degrees of freedom.
    half = std * float(student.isf((1 - LEVEL) / 2, found.freedom))
    return Change(size, std, size - half, size + half)
