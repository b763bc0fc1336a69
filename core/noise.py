"""How large is the noise of a sensor, judged from the record itself?"""

import numpy as np
from scipy import ndimage, signal

from core.arrays import Matrix, Vector
from core.errors import RecordError

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
    length = round(WINDOW * rate)
    if samples.shape[1] < 5 * length:
        raise RecordError(f"{samples.shape[1] / rate:.3g} s are too short to judge the noise; 10 s would do")
    frequency, _, spectra = signal.spectrogram(samples, rate, nperseg=length, noverlap=length // 2, window="hann")
    high = frequency > min(STRUCTURE_ENDS, 0.6 * rate / 2)
    density = np.array([_quiet_density(spectrum, high) for spectrum in spectra])
    passed = density >= FILTERED_AWAY * np.quantile(density[:, high], 0.75, axis=1, keepdims=True)
    # the median, since a filter's edge is passed in part
    level = np.nanmedian(np.where(passed & high, density, np.nan), axis=1, keepdims=True)
    return np.asarray(np.sqrt(np.where(passed, level, density).sum(axis=1, where=frequency > 0) * frequency[1]))


def _quiet_density(spectrum: Matrix, high: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Vector:
    """(frequencies,) mean of a (frequencies, times) spectrogram over the stretch with the least motion at high ones."""
    windows = max(1, round(QUIET * spectrum.shape[1]))
    running = ndimage.uniform_filter1d(spectrum[high].mean(axis=0), windows, mode="nearest")
    inside = running[windows // 2 : spectrum.shape[1] - (windows - 1) // 2]
    start = int(np.argmin(inside))
    return np.asarray(spectrum[:, start : start + windows].mean(axis=1))
