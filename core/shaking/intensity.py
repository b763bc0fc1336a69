"""Instrumental seismic intensity and velocity of long-period motion, as the Japan Meteorological Agency defines them.

The agency determines both at its own stations on the ground; values from another instrument are unofficial.
"""

import numpy as np
import scipy

from core.arrays import Matrix, Vector
from core.shaking.oscillators import DAMPING, oscillator_velocity

EXCEEDED = 0.3
"""s, total time for which the filtered acceleration exceeds the one that gives the intensity."""
HIGH_CUT = (1.0, 0.694, 0.241, 0.0557, 0.009664, 0.00134, 0.000155)
"""Coefficients of y⁰, y², y⁴ ... y¹² of the high-cut filter, y = f / 10 Hz."""
GAL = 1e2
"""gal per m/s²."""
PERIODS = np.round(np.arange(1.6, 7.81, 0.2), 1)
"""s, of the oscillators that give the class of long-period motion."""
SLOWEST = 19.48
"""s, corner period of the high-pass filter of second order for velocities (JMA, 2017: nominally 20 s)."""


def instrumental_intensity(acceleration: Matrix, rate: float) -> float:
    """JMA instrumental intensity I = 2 log10(a0) + 0.94 (Meteorological Agency, notification 4 of 1996).

    The notification has three components; fewer give a lower bound.

    Args:
        acceleration: (components, n) m/s², perpendicular to each other.
        rate: Hz.

    Returns:
        The intensity without rounding; -inf without motion.
    """
    count = acceleration.shape[1]
    frequency = np.asarray(np.fft.rfftfreq(count, 1 / rate), dtype=float)
    spectra = np.fft.rfft(acceleration) * _intensity_filter(frequency)
    strength = np.sort(np.linalg.norm(np.fft.irfft(spectra, count), axis=0))[::-1]
    a0 = strength[min(count, max(1, round(EXCEEDED * rate))) - 1] * GAL
    return float(2 * np.log10(a0) + 0.94) if a0 > 0 else -np.inf


def long_period_velocity(acceleration: Matrix, rate: float) -> float:
    """m/s, largest absolute velocity of oscillators with 5 % damping and periods of 1.6 to 7.8 s.

    Horizontal components are combined as vectors at every instant (JMA, 2016).

    Args:
        acceleration: (components, n) m/s², horizontal.
        rate: Hz.
    """
    slow = without_slow_motion(acceleration, rate)
    ground = scipy.integrate.cumulative_trapezoid(slow, dx=1 / rate, initial=0.0)
    each = (oscillator_velocity(slow, rate, 2 * np.pi / period, DAMPING) for period in PERIODS)
    return max(float(np.linalg.norm(ground + relative, axis=0).max()) for relative in each)


def without_slow_motion(acceleration: Matrix, rate: float) -> Matrix:
    """(components, n) m/s² without what is slower than 20 s, of which an accelerometer records its own drift."""
    sections = scipy.signal.butter(2, 1 / SLOWEST, "highpass", fs=rate, output="sos")
    return np.asarray(scipy.signal.sosfilt(sections, acceleration, axis=-1))


def _intensity_filter(frequency: Vector) -> Vector:
    """(k,) gain at frequencies in Hz: effect of the period, high cut and low cut."""
    f = np.maximum(frequency, 1e-12)
    high_cut = 1 / np.sqrt(np.polynomial.polynomial.polyval((f / 10) ** 2, HIGH_CUT))
    low_cut = np.sqrt(-np.expm1(-((f / 0.5) ** 3)))
    return np.asarray(np.where(frequency > 0, high_cut * low_cut / np.sqrt(f), 0.0))
