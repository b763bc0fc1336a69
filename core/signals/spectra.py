"""Spectra under a Hann window, and smoothed periodograms."""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, Matrix, Vector

SMOOTHING = 2 ** (1 / 4)
"""Frequency ratio, on either side, over which a periodogram is averaged. A choice: half an octave in all, narrower than
any slope that matters here."""
FEWEST_BINS = 5
"""Bins that are averaged at least. A choice: their mean has a standard deviation of 45 %."""
HANN_CORRELATION = 1 + 2 * (4 / 9 + 1 / 36)
"""Factor by which neighbouring lines of a periodic Hann window hold less information than independent ones: the squares
of their correlations 2/3 and 1/6 (Harris, 1978)."""


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
