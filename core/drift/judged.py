"""What do the rules judge of a series, and how strongly does it speak for each of them?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Mask, Matrix, Vector
from core.drift.rules import Rule
from core.drift.sequential import CLIP, Innovations, evidence, innovations
from core.drift.series import SeriesEvent


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """The events after the reference that can be compared with it, in order of time."""

    dated: tuple[SeriesEvent, ...]
    deviation: Vector
    """(n,) from what was expected; natural logarithm, or SI units."""
    covariance: Matrix
    """(n, n) of the deviations while the building is healthy."""
    freedom: float
    """Degrees of freedom of the covariance's scale."""
    before: "Before"
    """The reference."""

    def innovations(self, clip: float = CLIP) -> Innovations:
        """Each deviation less what those before it foretell, in standard deviations."""
        return innovations(self.deviation, self.covariance, self.freedom, clip)


@dataclass(frozen=True, slots=True, eq=False)
class Before:
    """The events of the reference, in order of time."""

    dated: tuple[SeriesEvent, ...]
    deviation: Vector
    """(m,) from what was expected, in the unit of those judged."""
    std: Vector
    """(m,) of each, the baseline taken as known."""


def strengths(white: Innovations, rule: Rule, start: int) -> Matrix:
    """(n, onsets) standard deviations for a change by the latest event and the onset; 0 where too few events speak.

    Args:
        white: of the n events.
        rule: what is looked for.
        start: the first onset that is allowed.
    """
    root, speaking = evidence(white, rule.pattern(white.raw.size), rule.sense)
    return np.where((speaking >= rule.speaking) & _allowed(white.raw.size, start), root, 0.0)


def gathering(white: Innovations, rule: Rule, start: int) -> Vector:
    """(onsets,) the same at the latest event, with however few that speak."""
    root, speaking = evidence(white, rule.pattern(white.raw.size), rule.sense)
    return np.where((speaking[-1] >= 1) & _allowed(white.raw.size, start), root[-1], 0.0)


def _allowed(count: int, start: int) -> Mask:
    return np.asarray(np.arange(count) >= start)
