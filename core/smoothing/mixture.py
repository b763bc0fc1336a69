"""The force's uncertainty where a record does not decide between hypotheses.

The evidence (Laplace's approximation) chooses one hypothesis. Where a building is a little unlike all of them, another
may be nearer to it, by more than the standard deviation of the chosen one. The force keeps the estimate of the chosen
hypothesis; its variance grows by the mean square of the distance to the others.
"""

import numpy as np

from core.arrays import Vector
from core.smoothing.all_floors import Smoothed, force_history
from core.smoothing.hypotheses import Choice
from core.smoothing.line_weights import LinearModel
from core.smoothing.shape_error import local_mean_square
from core.smoothing.spectral_lines import Lines
from core.smoothing.superstructure_model import Design

BEYOND = 1.5
"""Mean square of the building's distance over that of a rival as likely as the chosen hypothesis.

It is above 1 because the building may lie beyond the rival. Chosen on even seeds of tests/support/covered.py."""


def mixed_std(lines: Lines, design: Design, choice: Choice, base_mass: float, found: Smoothed) -> Vector:
    """(n,) N, standard deviation of the force with what the rivals of the chosen hypothesis add to it.

    Args:
        lines: all of the record's spectrum.
        design: of the building.
        choice: the hypothesis chosen, and its rivals.
        base_mass: kg.
        found: by the one chosen.
    """
    variance = found.std**2
    for rival in choice.rivals:
        calibration = rival.calibration
        model = LinearModel(lines, design, calibration, calibration.parameters, calibration.structure, base_mass)
        apart = force_history(model) - found.force
        variance = variance + BEYOND * rival.weight * local_mean_square(apart[None], lines.rate)
    return np.asarray(np.sqrt(variance))
