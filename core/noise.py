"""How large is the noise of a sensor, judged from the record itself?"""

from typing import Any

import numpy as np
from scipy import ndimage, signal

from core.arrays import Matrix, Vector
from core.errors import RecordError

Passed = np.ndarray[Any, np.dtype[np.bool_]]
WINDOW = 2.0
"""s, of one spectrum."""
QUIET = 0.2
"""Share of the record, in one piece, that is taken for quiet: before the event or in its tail."""
STRUCTURE_ENDS = 15.0
"""Hz, above which building and ground move little."""
FILTERED_AWAY = 0.25
"""Share of the noise's level below which a frequency has been filtered out."""


def noise_std(samples: Matrix, rate: float) -> Vector:
    """Standard deviation of each channel's noise, taken as white within the band the record holds.

    The level is that of `noise_density`, over the frequencies that no filter took away before.

    Args:
        samples: (channels, n).
        rate: Hz.

    Returns:
        (channels,) in the samples' unit.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    frequency, density, passed = _quiet_spectra(samples, rate)
    level = _level(frequency, density, passed, rate)[:, None]
    return np.asarray(np.sqrt(np.where(passed, level, density).sum(axis=1, where=frequency > 0) * frequency[1]))


def noise_density(samples: Matrix, rate: float) -> Vector:
    """One-sided spectral density of each channel's noise within the band the record holds.

    The level is that of the spectrum above 15 Hz in the quietest fifth of the record. Where the structure never comes
    to rest the result is an upper bound.

    Args:
        samples: (channels, n).
        rate: Hz.

    Returns:
        (channels,) in the samples' unit squared, per Hz.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    return _level(*_quiet_spectra(samples, rate), rate)


def _quiet_spectra(samples: Matrix, rate: float) -> tuple[Vector, Matrix, Passed]:
    """(frequencies,) Hz, (channels, frequencies) density where it is quiet, and where no filter took it away."""
    length = round(WINDOW * rate)
    if samples.shape[1] < 5 * length:
        raise RecordError(f"{samples.shape[1] / rate:.3g} s are too short to judge the noise; 10 s would do")
    frequency, _, spectra = signal.spectrogram(samples, rate, nperseg=length, noverlap=length // 2, window="hann")
    density = np.array([_quiet_density(spectrum, _high(frequency, rate)) for spectrum in spectra])
    loud = np.quantile(density[:, _high(frequency, rate)], 0.75, axis=1, keepdims=True)
    return frequency, density, density >= FILTERED_AWAY * loud


def _high(frequency: Vector, rate: float) -> Passed:
    return np.asarray(frequency > min(STRUCTURE_ENDS, 0.6 * rate / 2))


def _level(frequency: Vector, density: Matrix, passed: Passed, rate: float) -> Vector:
    """(channels,) the median, since a filter's edge is passed in part."""
    return np.asarray(np.nanmedian(np.where(passed & _high(frequency, rate), density, np.nan), axis=1))


def _quiet_density(spectrum: Matrix, high: Passed) -> Vector:
    """(frequencies,) mean of a (frequencies, times) spectrogram over the stretch with the least motion at high ones."""
    windows = max(1, round(QUIET * spectrum.shape[1]))
    running = ndimage.uniform_filter1d(spectrum[high].mean(axis=0), windows, mode="nearest")
    inside = running[windows // 2 : spectrum.shape[1] - (windows - 1) // 2]
    start = int(np.argmin(inside))
    return np.asarray(spectrum[:, start : start + windows].mean(axis=1))
