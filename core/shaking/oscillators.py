"""Linear oscillators driven by an acceleration, exact for motion that is linear between samples.

Nigam and Jennings (1969), as one recursive filter per oscillator. `eqsig` takes the same steps in a Python loop.
"""

from functools import lru_cache

import numpy as np
import scipy

from core.arrays import Matrix, Vector
from core.signals.conditioning import Samples

DAMPING = 0.05
"""Damping ratio of response spectra."""


def oscillator_motion(
    acceleration: Samples, rate: float, angular_frequency: float, damping_ratio: float
) -> tuple[Samples, Samples]:
    """Displacement and velocity of an oscillator relative to its support, from rest.

    Args:
        acceleration: (..., n) m/s², of the support.
        rate: Hz.
        angular_frequency: rad/s, undamped.
        damping_ratio: part of critical damping.

    Returns:
        Two (..., n) arrays, m and m/s.
    """
    of_displacement, _, denominator = _filters(rate, angular_frequency, damping_ratio)
    displacement: Samples = scipy.signal.lfilter(of_displacement, denominator, acceleration)
    return displacement, oscillator_velocity(acceleration, rate, angular_frequency, damping_ratio)


def oscillator_velocity(acceleration: Samples, rate: float, angular_frequency: float, damping_ratio: float) -> Samples:
    """(..., n) m/s, the velocity of `oscillator_motion` alone.

    Args: as of `oscillator_motion`.
    """
    _, of_velocity, denominator = _filters(rate, angular_frequency, damping_ratio)
    velocity: Samples = scipy.signal.lfilter(of_velocity, denominator, acceleration)
    return velocity


def response_spectrum(acceleration: Vector, rate: float, periods: Vector) -> Vector:
    """(k,) m/s², pseudo-acceleration ω² max |u| of oscillators with 5 % damping.

    Args:
        acceleration: (n,) m/s².
        rate: Hz.
        periods: (k,) s.
    """
    angular = 2 * np.pi / periods
    filters = [_filters(rate, float(one), DAMPING) for one in angular]
    peaks = [np.abs(scipy.signal.lfilter(own, denominator, acceleration)).max() for own, _, denominator in filters]
    return np.asarray(angular**2 * peaks)


@lru_cache(1024)  # the response spectra of every event have the same periods
def _filters(rate: float, angular_frequency: float, damping_ratio: float) -> tuple[Vector, Vector, Vector]:
    """(3,) numerators of the displacement and of the velocity, and (3,) denominator, of the recursive filters."""
    transition, inputs = _step(rate, angular_frequency, damping_ratio)
    trace, determinant = np.trace(transition), np.linalg.det(transition)
    others = transition - trace * np.eye(2)
    before, now = inputs.T
    of_displacement, of_velocity = np.column_stack([now, before + others @ now, others @ before])
    return of_displacement, of_velocity, np.array([1.0, -trace, determinant])


def _step(rate: float, angular_frequency: float, damping_ratio: float) -> tuple[Matrix, Matrix]:
    """(2, 2) transition of displacement and velocity over a sample, and (2, 2) effect of the samples at its ends."""
    system = np.zeros((4, 4))  # displacement, velocity, acceleration of the support, its change over the sample
    system[0, 1] = 1.0
    system[1] = [-(angular_frequency**2), -2 * damping_ratio * angular_frequency, -1.0, 0.0]
    system[2, 3] = rate
    over = scipy.linalg.expm(system / rate)
    slope = over[:2, 3]
    return over[:2, :2], np.column_stack([over[:2, 2] - slope, slope])
