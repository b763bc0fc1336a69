"""The paper's simulated building and its earthquake (section 7), for demonstrations, tests and benchmarks."""

from fractions import Fraction

import numpy as np
import scipy

from core.arrays import Vector
from core.building import ShearBuilding
from core.errors import RecordError
from core.model.isolator import Isolator

BUILDING = ShearBuilding(
    base_mass=8.0e6,
    floor_mass=np.array([2.7e6, 2.6e6, 2.4e6, 2.0e6, 1.9e6, 2.2e6, 2.3e6]),
    storey_stiffness=np.array([3.10e9, 2.93e9, 2.34e9, 1.97e9, 1.59e9, 1.46e9, 1.34e9]),
    damping_coefficient=0.002915,
)
"""The masses and stiffnesses of Figure 5 are lost; this structure is consistent with the paper, not a recovery.

It has the paper's total mass and every printed digit of Table I. The shapes of Table III, which were identified from
noisy records, agree to 0.1 %.
"""

FOURTH_STOREY = 2
"""Index of the fourth storey's floor, where the paper has a sensor between base slab and roof."""

ISOLATOR = Isolator(
    {
        "elastic": {"k_b": 475.0e6},
        "viscous": {"c_b": 6.0e6},
        "bouc_wen": {"F_y": 655.4e3, "D_y": 1.5e-3, "A": 1.0, "beta": 0.6, "gamma": 0.4, "n": 1.0},
    }
)
"""Table II; A, which the paper does not print, is 1."""

RATE = 100.0
"""Hz, of the paper's records."""
PEAK = 0.7013
"""m/s², of the ground acceleration observed at Hiyoshi (Figure 6)."""
DURATION = 180.0
"""s, of a ground motion and the time at rest around it. Not tuned."""
LEAD = 10.0
"""s at rest before the ground moves. Not tuned."""
BAND = (0.1, 30.0)
"""Hz, pass band of a ground motion: that of the analysis."""


def ground_motion(acceleration: Vector, rate: float) -> Vector:
    """A recorded motion in place of the paper's, which is not available: at RATE, at rest before and after, within
    BAND, and with the paper's peak.

    Args:
        acceleration: (n,) any unit, as recorded.
        rate: Hz.

    Returns:
        (DURATION * RATE,) m/s².

    Raises:
        RecordError: the record is longer than what the lead leaves of DURATION, or the ground does not move in it.
    """
    ratio = Fraction(RATE / rate).limit_denominator(1000)
    moving = scipy.signal.resample_poly(acceleration - acceleration.mean(), ratio.numerator, ratio.denominator)
    padded, lead = np.zeros(round(DURATION * RATE)), round(LEAD * RATE)
    if moving.size > padded.size - lead:
        raise RecordError(
            f"the ground motion lasts {moving.size / RATE:.4g} s; cut it to its strongest {DURATION - LEAD:g} s or less"
        )
    padded[lead : lead + moving.size] = moving
    filtered = scipy.signal.sosfiltfilt(scipy.signal.butter(4, BAND, "bandpass", fs=RATE, output="sos"), padded)
    peak = np.abs(filtered).max()
    if not peak > 0:
        raise RecordError("the ground does not move in this record; use one with an earthquake")
    return np.asarray(filtered * PEAK / peak)
