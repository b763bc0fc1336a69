"""What do sines that vanish at a record's first and last sample say of it, of its derivative and of their errors?

They are the record's odd extension, which has no jump in value or slope once the line between the record's ends is
taken out, so that a record which does not begin and end at rest is differentiated and integrated without ringing.
"""

import numpy as np
from scipy.fft import dct, dst, idst, rfft

from core.arrays import Vector
from core.isolation_layer.motion import Motion


def angular_frequencies(size: int, rate: float) -> Vector:
    """(size − 2,) rad/s, of the sines of a record of so many samples."""
    frequencies: Vector = np.pi * np.arange(1, size - 1) * rate / (size - 1)
    return frequencies


def coefficients(samples: Vector) -> Vector:
    """(n − 2,) of the sines; what the (n,) samples have at their two ends does not count."""
    return np.asarray(dst(samples[1:-1], type=1))


def of_falling_line(size: int) -> Vector:
    """(size − 2,) coefficients of the line that falls from 1 to 0 over so many samples."""
    return np.asarray(1 / np.tan(np.pi * np.arange(1, size - 1) / (2 * (size - 1))))


def power(sines: Vector) -> Vector:
    """(n − 2,) periodogram of a series' coefficients: white noise has its variance in each."""
    return np.asarray(sines**2 / (2 * (sines.size + 1)))


def motion(sines: Vector, line: Vector, rate: float) -> Motion:
    """Sum of the series and of an (n,) straight line, and its exact derivative."""
    ω = angular_frequencies(line.size, rate)
    slope = (line[-1] - line[0]) * rate / (line.size - 1)
    displacement = line.copy()
    displacement[1:-1] += idst(sines, type=1)
    cosines = np.concatenate([[0.0], sines * ω, [0.0]])
    velocity: Vector = dct(cosines, type=1) / (2 * (line.size - 1)) + slope
    return Motion(displacement=displacement, velocity=velocity)


def variances(density: Vector, ω: Vector) -> tuple[Vector, Vector]:
    """(n,) and (n,) variance at each sample of a series of independent terms, and of its derivative.

    Args:
        density: (n − 2,) expected periodogram.
        ω: (n − 2,) rad/s.
    """
    terms = np.array([density, density * ω**2])
    half = rfft(np.pad(terms, ((0, 0), (1, 0)))).real  # Σ s_k cos(2π k i / (n − 1)), which is even in i
    along = np.hstack([half, half[:, : ω.size + 2 - half.shape[1]][:, ::-1]])
    series, derivative = (along[:, :1] + [[-1.0], [1.0]] * along) / (ω.size + 1)
    return np.maximum(series, 0.0), np.maximum(derivative, 0.0)
