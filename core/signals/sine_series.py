"""Sine series of a record: its exact derivative, and the variances of both.

The sines vanish at the first and last sample. Together with the straight line between the record's ends they are its
odd extension, without a jump in value or slope: a record that does not begin and end at rest is differentiated and
integrated without Gibbs oscillations.
"""

import numpy as np
from scipy.fft import dct, dst, idst, rfft

from core.arrays import Vector


def angular_frequencies(size: int, rate: float) -> Vector:
    """(size − 2,) rad/s, of the sines of a record of `size` samples."""
    frequencies: Vector = np.pi * np.arange(1, size - 1) * rate / (size - 1)
    return frequencies


def coefficients(samples: Vector) -> Vector:
    """(n − 2,) coefficients of the sines; the values of the (n,) samples at both ends do not count."""
    return np.asarray(dst(samples[1:-1], type=1))


def falling_line(size: int) -> Vector:
    """(size − 2,) coefficients of the line that falls from 1 to 0 over `size` samples."""
    return np.asarray(1 / np.tan(np.pi * np.arange(1, size - 1) / (2 * (size - 1))))


def power(sines: Vector) -> Vector:
    """(n − 2,) periodogram of a series' coefficients: white noise has its variance in each."""
    return np.asarray(sines**2 / (2 * (sines.size + 1)))


def sum_with_line(sines: Vector, line: Vector, rate: float) -> tuple[Vector, Vector]:
    """(n,) sum of the series and of an (n,) straight line, and its exact derivative by time."""
    ω = angular_frequencies(line.size, rate)
    slope = (line[-1] - line[0]) * rate / (line.size - 1)
    values = line.copy()
    values[1:-1] += idst(sines, type=1)
    cosines = np.concatenate([[0.0], sines * ω, [0.0]])
    derivative: Vector = dct(cosines, type=1) / (2 * (line.size - 1)) + slope
    return values, derivative


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
