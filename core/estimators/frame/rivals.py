"""Hypotheses that a record prefers less than the chosen one, but does not rule out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.estimators.frame.calibration import Calibration

TEMPERATURE = 100.0
"""Of log evidence, by which the weight of a hypothesis falls to 1/e.

It would be 1 if one of the hypotheses were the building. Where none is, evidence preferred the less exact of two by up
to 120. Chosen on even seeds of tests/support/covered.py."""
NEGLIGIBLE = 0.02
"""Weight below which a hypothesis is left out."""


@dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """A hypothesis that was not chosen."""

    calibration: Calibration
    weight: float
    """1 for as much evidence as the chosen one has."""


def rivals(judged: Sequence[tuple[float, Calibration]], best: Calibration) -> tuple[Rival, ...]:
    """The hypotheses that count beside the best.

    They leave a parameter open that the best holds. The others are special cases of it, within its own uncertainty.

    Args:
        judged: log evidence and calibration, the best among them.
        best: the one chosen.
    """
    highest = next(evidence for evidence, calibration in judged if calibration is best)
    weighed = (
        Rival(calibration, float(np.exp(min(0.0, (evidence - highest) / TEMPERATURE))))
        for evidence, calibration in judged
        if np.setdiff1d(calibration.hypothesis.free, best.hypothesis.free).size
    )
    return tuple(rival for rival in weighed if rival.weight > NEGLIGIBLE)
