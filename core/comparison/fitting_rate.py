"""How well does an estimate fit, by the measure that the paper prints?"""

import numpy as np

from core.arrays import Vector


def fitting_rate(truth: Vector, estimate: Vector) -> float:
    """The paper's fitting rate (Figures 10-12 and 16): 100 (1 - ‖y - ŷ‖ / ‖y - mean(y)‖) over the whole record.

    Args:
        truth: (n,) y, any unit; not constant.
        estimate: (n,) ŷ, of the same unit.

    Returns:
        Percent: 100 for an exact estimate, 0 for the truth's mean, negative for anything worse.
    """
    return float(100 * (1 - np.linalg.norm(truth - estimate) / np.linalg.norm(truth - truth.mean())))
