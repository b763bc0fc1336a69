"""The force's uncertainty where a record does not decide between hypotheses.

The evidence (Laplace's approximation) chooses one hypothesis. Where a building is a little unlike all of them, another
may be nearer to it, by more than the standard deviation of the chosen one. The force keeps the estimate of the chosen
hypothesis; its variance grows by the mean square of the distance to the others.
"""

import numpy as np

from core.arrays import Matrix
from core.estimators.frame.all_floors import Smoothed, force_history
from core.estimators.frame.hypotheses import Choice
from core.estimators.frame.line_weights import LinearModel
from core.estimators.frame.spectral_lines import Lines
from core.estimators.frame.superstructure_model import Design

BEYOND = 1.5
"""Mean square of the building's distance over that of a rival as likely as the chosen hypothesis.

It is above 1 because the building may lie beyond the rival. Chosen on even seeds of tests/support/covered.py."""


def rival_errors(lines: Lines, design: Design, choice: Choice, base_mass: float, found: Smoothed) -> Matrix:
    """(rivals, n) N, one standard deviation of the force towards each rival of the chosen hypothesis.

    Args:
        lines: all of the record's spectrum.
        design: of the building.
        choice: the hypothesis chosen, and its rivals.
        base_mass: kg.
        found: by the one chosen.
    """
    errors = np.zeros((len(choice.rivals), lines.samples))
    for row, rival in zip(errors, choice.rivals, strict=True):
        calibration = rival.calibration
        model = LinearModel(lines, design, calibration, calibration.parameters, calibration.structure, base_mass)
        row[:] = np.sqrt(BEYOND * rival.weight) * (force_history(model) - found.force)
    return errors
