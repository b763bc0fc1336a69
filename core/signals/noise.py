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
NEXT = 4 / 3
"""Times the frequency above which the structure moves little: where the noise is most like that below."""
FILTERED_AWAY = 0.25
"""Share of the noise's level below which a frequency has been filtered out."""


def noise_std(samples: Matrix, rate: float) -> Vector:
    """Standard deviation of each channel's noise, taken as white within the band the record holds.

    The level is that of the spectrum above 15 Hz in the quietest fifth of the record, over the frequencies that no
    filter took away before. Where the structure never comes to rest the result is an upper bound.

    Args:
        samples: (channels, n).
        rate: Hz.

    Returns:
        (channels,) in the samples' unit.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    frequency, density, passed = _quiet_spectra(samples, rate)
    # the median, since a filter's edge is passed in part
    level = np.nanmedian(np.where(passed & _high(frequency, rate), density, np.nan), axis=1, keepdims=True)
    return np.asarray(np.sqrt(np.where(passed, level, density).sum(axis=1, where=frequency > 0) * frequency[1]))


def noise_density(samples: Matrix, rate: float) -> Vector:
    """One-sided spectral density of each channel's noise within the band the record holds.

    The level is that of the spectrum in the quietest fifth of the record, from 15 to 20 Hz: just above the structure's
    motion, and below where filters begin to take noise away. Where the structure never comes to rest the result is an
    upper bound.

    Args:
        samples: (channels, n).
        rate: Hz.

    Returns:
        (channels,) in the samples' unit squared, per Hz.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    frequency, density, _ = _quiet_spectra(samples, rate)
    high = frequency[_high(frequency, rate)]
    return np.asarray(np.median(density[:, (frequency >= high[0]) & (frequency <= NEXT * high[0])], axis=1))


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


def _quiet_density(spectrum: Matrix, high: Passed) -> Vector:
    """(frequencies,) mean of a (frequencies, times) spectrogram over the stretch with the least motion at high ones."""
    windows = max(1, round(QUIET * spectrum.shape[1]))
    running = ndimage.uniform_filter1d(spectrum[high].mean(axis=0), windows, mode="nearest")
    inside = running[windows // 2 : spectrum.shape[1] - (windows - 1) // 2]
    start = int(np.argmin(inside))
    return np.asarray(spectrum[:, start : start + windows].mean(axis=1))
