"""Statistics of a change in a sequence of deviations: signed roots of likelihood ratios, and the size of a change.

The generalised likelihood ratio over onset and size (Lorden, 1971; Willsky and Jones, 1976) for deviations that share
the error of their baseline. Whitening by the Cholesky factor of their covariance makes them innovations: each deviation
less its prediction from those before it. The scale of the covariance is known from the reference with a few degrees of
freedom, which makes the ratio one of Student's t. Innovations are clipped, so that one event alone cannot make a
change.
"""

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
import scipy
from scipy.linalg import cholesky, solve_triangular

from core.arrays import Indices, Matrix, Vector
from core.drift.series import SeriesEvent

CLIP = 4.0
"""Standard deviations that an innovation counts at most in the decision whether there is a change. A choice; the
rates of `core.drift.rules` hold with it."""
LOCATING_CLIP = 8.0
"""Standard deviations that it counts at most in the decision where a change began. A choice: twice `CLIP`."""
SUPPORT = 1.5
"""Standard deviations by which an event must deviate to support a change. A choice; the rates of
`core.drift.rules` hold with it. A healthy event deviates so far to one side in 7 % of cases."""
LEVEL = 0.95
"""Probability of the interval of a change."""
ROUNDS = 3
"""Rounds of reweighting in the size of a change. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Innovations:
    """n whitened deviations: independent, with unit variance, while the building is healthy."""

    lower: Matrix
    """(n, n) Cholesky factor of the covariance."""
    clipped: Vector
    """(n,) clipped innovations, each less the prediction from the clipped ones before it."""
    raw: Vector
    """(n,) innovations without clipping."""
    freedom: float
    """Degrees of freedom of the scale of the covariance."""


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Evidence of n innovations for changes that begin at each onset, summed up to the latest event."""

    evidence: Matrix
    """(n, onsets) innovation of each event in the direction of a rise; 0 before the onset."""
    along: Matrix
    """(n, onsets) sum of the innovations along the whitened change."""
    length: Matrix
    """(n, onsets) sum of its squares."""


@dataclass(frozen=True, slots=True)
class ChangeSize:
    """Estimated size of a change; natural logarithm, or SI units."""

    size: float
    std: float
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end of the 95 % interval."""


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceDeviations:
    """Deviations of the m events of the reference, in order of time."""

    events: tuple[SeriesEvent, ...]
    deviation: Vector
    """(m,) natural logarithm, or SI units."""
    std: Vector
    """(m,) standard deviation of each, the baseline assumed known."""


@dataclass(frozen=True, slots=True, eq=False)
class DeviationSequence:
    """Deviations of the n events that the rules test: those after the reference that can be compared with it."""

    event: Indices
    """(n,) identifiers in order of time."""
    time: Vector
    """(n,) s since 1970-01-01 UTC, of the first measurement."""
    deviation: Vector
    """(n,) natural logarithm, or SI units."""
    own: Vector
    """(n,) variance of each while the building is healthy, beside the errors that events share."""
    common: Matrix
    """(n, errors) errors that events share, each by one standard deviation."""
    freedom: float
    """Degrees of freedom of the scale of the covariance."""
    reference: ReferenceDeviations
    correlated: Matrix | None = None
    """(n, n) covariance beside `own` and `common`; None where there is no other."""

    @property
    def events(self) -> tuple[SeriesEvent, ...]:
        """In order of time."""
        times = (datetime.fromtimestamp(one, UTC) for one in self.time.tolist())
        return tuple(map(SeriesEvent, self.event.tolist(), times))

    @property
    def covariance(self) -> Matrix:
        """(n, n) covariance of the deviations while the building is healthy."""
        shared = self.common @ self.common.T + np.diag(self.own)
        return np.asarray(shared if self.correlated is None else shared + self.correlated)

    def innovations(self, clip: float = CLIP) -> Innovations:
        """Each deviation less its prediction from those before it, in standard deviations."""
        return innovations(self.deviation, self.covariance, self.freedom, clip)


def innovations(deviation: Vector, covariance: Matrix, freedom: float, clip: float) -> Innovations:
    """Whiten a sequence of deviations.

    Args:
        deviation: (n,) deviations in order of time.
        covariance: (n, n) their covariance.
        freedom: degrees of freedom of its scale.
        clip: standard deviations that an innovation counts at most.
    """
    lower = np.asarray(cholesky(covariance, lower=True))
    clipped = np.zeros(deviation.size)
    for n in range(deviation.size):  # predicted from clipped values, so that an outlier does not mislead the next
        ahead = (deviation[n] - lower[n, :n] @ clipped[:n]) / lower[n, n]
        clipped[n] = np.clip(ahead, -clip, clip)
    return Innovations(lower, clipped, np.asarray(solve_triangular(lower, deviation, lower=True)), freedom)


def first_innovations(white: Innovations, count: int) -> Innovations:
    """The innovations of the first `count` events."""
    return Innovations(white.lower[:count, :count], white.clipped[:count], white.raw[:count], white.freedom)


def whitened(white: Innovations, patterns: Matrix) -> Matrix:
    """(n, k) effect of (n, k) patterns of deviations on the innovations."""
    return np.asarray(solve_triangular(white.lower, patterns, lower=True))


def response(white: Innovations, patterns: Matrix) -> Response:
    """Response of n innovations to (n, onsets) deviations that a change of size one brings."""
    white_patterns = whitened(white, patterns)
    along = white_patterns * white.clipped[:, None]
    return Response(
        evidence=np.where(patterns > 0, np.sign(white_patterns) * white.clipped[:, None], 0.0),
        along=np.cumsum(along, axis=0),
        length=np.maximum(np.cumsum(white_patterns**2, axis=0), np.finfo(float).tiny),
    )


def signed_roots(white: Innovations, patterns: Matrix, sign: int) -> tuple[Matrix, Indices]:
    """Signed roots of twice the log likelihood ratio, by the latest event and the onset.

    Args:
        white: n innovations.
        patterns: (n, onsets) deviations that a change of size one brings.
        sign: -1 for a fall, +1 for a rise; 0 is the root of a change with the other sign.

    Returns:
        (n, onsets) roots, and (n, onsets) numbers of events that support the change.
    """
    return roots_of_response(white, response(white, patterns), sign)


def roots_of_response(white: Innovations, found: Response, sign: int) -> tuple[Matrix, Indices]:
    """`signed_roots` of a known response, which changes of either sign share."""
    explained = np.maximum(sign * found.along, 0.0) ** 2 / found.length
    total = np.cumsum(white.clipped**2)[:, None]
    count = white.freedom + np.arange(1, white.clipped.size + 1)[:, None]
    root = np.sqrt(count * np.log((white.freedom + total) / (white.freedom + total - explained)))
    return root, np.asarray(np.cumsum(sign * found.evidence > SUPPORT, axis=0))


def change_size(white: Innovations, pattern: Vector) -> ChangeSize:
    """Size of an (n,) pattern by robust least squares, with its interval by Student's t."""
    white_pattern = np.asarray(solve_triangular(white.lower, pattern, lower=True))
    weight = np.ones(white_pattern.size)
    for _ in range(ROUNDS):
        size = float((weight * white_pattern) @ white.raw / ((weight * white_pattern) @ white_pattern))
        residual = white.raw - size * white_pattern
        weight = 1 / np.maximum(1.0, np.abs(residual) / CLIP)
    scale = (white.freedom + weight @ residual**2) / (white.freedom + white_pattern.size)
    std = float(np.sqrt(scale / ((weight * white_pattern) @ white_pattern)))
    # Most of the error is that of the level before, whose scatter is known from the reference alone.
    half = std * float(scipy.stats.t.isf((1 - LEVEL) / 2, white.freedom))
    return ChangeSize(size, std, size - half, size + half)
