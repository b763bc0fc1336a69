"""Spectra under a Hann window, smoothed periodograms, and sine series.

The sines of a series vanish at the first and last sample. Together with the straight line between the record's ends
they are its odd extension, without a jump in value or slope: a record that does not begin and end at rest is
differentiated and integrated without Gibbs oscillations. The series gives the record's exact derivative, and the
variances of both.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, dst, idst, rfft

from core.arrays import ComplexMatrix, Matrix, Vector

SMOOTHING = 2 ** (1 / 4)
"""Frequency ratio, on either side, over which a periodogram is averaged. A choice: half an octave in all, narrower than
any slope that matters here."""
FEWEST_BINS = 5
"""Bins that are averaged at least. A choice: their mean has a standard deviation of 45 %."""
HANN_CORRELATION = 1 + 2 * (4 / 9 + 1 / 36)
"""Factor by which neighbouring lines of a periodic Hann window hold less information than independent ones: the squares
of their correlations 2/3 and 1/6 (Harris, 1978)."""

FINE = 64
"""Lines for which exponentials are computed where they are evenly spaced, besides one in so many of all."""
UNEVEN = 1e-10
"""Largest difference between the steps of evenly spaced lines, relative to a step: rounding causes 7e-11 in a record of
an hour."""


@dataclass(frozen=True, slots=True, eq=False)
class HannSpectra:
    """Discrete Fourier transforms of channels times a Hann window."""

    frequency: Vector
    """(lines,) Hz."""
    values: ComplexMatrix
    """(channels, lines), in the samples' unit."""
    window_power: float
    """Sum of the window's squares: the mean square that white noise of variance 1 has in each line."""


def hann_spectra(samples: Matrix, rate: float, band: tuple[float, float] = (0.0, np.inf)) -> HannSpectra:
    """Spectra of channels under a Hann window over the whole length.

    Args:
        samples: (channels, n).
        rate: Hz.
        band: Hz, lowest and highest frequency, both included.
    """
    window = np.hanning(samples.shape[1])
    frequency: Vector = np.asarray(np.fft.rfftfreq(window.size, 1 / rate), dtype=float)
    within = (frequency >= band[0]) & (frequency <= band[1])
    values = np.fft.rfft(samples * window, axis=1)[:, within]
    return HannSpectra(np.asarray(frequency[within]), values, float(np.sum(window**2)))


def squared(values: np.ndarray) -> np.ndarray:
    """Squared magnitudes; three times as fast as by numpy's magnitudes, which guard against overflow."""
    return np.asarray(values.real**2 + values.imag**2)


def real_parts(values: np.ndarray) -> Matrix:
    """(rows, ...) real and imaginary parts of each row of complex values, in turn."""
    return np.ascontiguousarray(values).reshape(len(values), -1).view(float)


def delay_factors(delays: Vector, angular: Vector) -> ComplexMatrix:
    """(k, lines) e^(-iωτ) of (k,) s; of evenly spaced lines, as products of few exponentials.

    Args:
        delays: (k,) s, τ.
        angular: (lines,) rad/s, ω, rising.
    """
    steps = np.diff(angular)
    if steps.size < FINE or np.ptp(steps) > UNEVEN * steps[0]:
        return np.asarray(np.exp(-1j * np.multiply.outer(delays, angular)))
    coarse, fine = (
        np.exp(-1j * np.multiply.outer(delays, each)) for each in (angular[::FINE] - angular[0], angular[:FINE])
    )
    return np.asarray((coarse[:, :, None] * fine[:, None]).reshape(delays.size, -1)[:, : angular.size])


def smoothed(power: Vector, frequency: Vector) -> Vector:
    """(k,) mean of a periodogram over half an octave around each frequency, and over FEWEST_BINS at least."""
    bins, half = np.arange(power.size), FEWEST_BINS // 2
    first = np.minimum(np.searchsorted(frequency, frequency / SMOOTHING), np.maximum(bins - half, 0))
    last = np.maximum(np.searchsorted(frequency, frequency * SMOOTHING), np.minimum(bins + half + 1, power.size))
    total = np.concatenate([[0.0], np.cumsum(power)])
    return np.asarray((total[last] - total[first]) / (last - first))


def second_derivative(displacement: Matrix | Vector, rate: float) -> Matrix:
    """Samples differentiated twice by central differences along the last axis, good well below the Nyquist frequency.

    Args:
        displacement: (n,) or (channels, n).
        rate: Hz.
    """
    return np.asarray(np.gradient(np.gradient(displacement, axis=-1), axis=-1) * rate**2)


def sine_frequencies(size: int, rate: float) -> Vector:
    """(size − 2,) rad/s, of the sines of a record of `size` samples."""
    frequencies: Vector = np.pi * np.arange(1, size - 1) * rate / (size - 1)
    return frequencies


def sine_coefficients(samples: Vector) -> Vector:
    """(n − 2,) coefficients of the sines; the values of the (n,) samples at both ends do not count."""
    return np.asarray(dst(samples[1:-1], type=1))


def falling_line(size: int) -> Vector:
    """(size − 2,) coefficients of the line that falls from 1 to 0 over `size` samples."""
    return np.asarray(1 / np.tan(np.pi * np.arange(1, size - 1) / (2 * (size - 1))))


def sine_power(sines: Vector) -> Vector:
    """(n − 2,) periodogram of a series' coefficients: white noise has its variance in each."""
    return np.asarray(sines**2 / (2 * (sines.size + 1)))


def sum_with_line(sines: Vector, line: Vector, rate: float) -> tuple[Vector, Vector]:
    """(n,) sum of the series and of an (n,) straight line, and its exact derivative by time."""
    ω = sine_frequencies(line.size, rate)
    slope = (line[-1] - line[0]) * rate / (line.size - 1)
    values = line.copy()
    values[1:-1] += idst(sines, type=1)
    cosines = np.concatenate([[0.0], sines * ω, [0.0]])
    derivative: Vector = dct(cosines, type=1) / (2 * (line.size - 1)) + slope
    return values, derivative


def sine_variances(density: Vector, ω: Vector) -> tuple[Vector, Vector]:
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
