"""Noise of sensors estimated from the record itself: white noise, drift and flicker; and the band clear of noise."""

import numpy as np
import scipy
from scipy import ndimage

from core.arrays import ComplexMatrix, Mask, Matrix, Vector
from core.errors import RecordError

MaskMatrix = np.ndarray[tuple[int, int], np.dtype[np.bool_]]
WINDOW = 2.0
"""s, of one spectrum. A choice: 0.5 Hz resolves the edges of usual filters, and 10 s give nine windows."""
FEWEST_WINDOWS = 5
"""Windows without overlap that a record must have, so that its quietest fifth is one of them. A choice."""
QUIET = 0.2
"""Share of the record, in one piece, that counts as quiet: before the event or in its tail. Not tuned."""
STRUCTURE_ENDS = 15.0
"""Hz, above which building and ground move little. A choice: above the modes that carry an isolated building's
force."""
HIGH_SHARE = 0.6
"""Share of the Nyquist frequency that replaces STRUCTURE_ENDS at low sampling rates. Not tuned."""
NEXT = 4 / 3
"""Ratio of the upper to the lower end of the density's band: 15 to 20 Hz, below the slope of a filter at 30 Hz."""
FILTERED_AWAY = 0.25
"""Share of the noise's level below which a frequency counts as filtered out. A choice: 6 dB."""
CLEAR = 9.0
"""Ratio of the record's power to that of its noise above which the signal is used: amplitudes of 3 to 1, after Boore
and Bommer (2005), who choose the corners of their filters in this way."""
DRIFT_BELOW = 0.03
"""Hz, below which all of an accelerometer's record counts as drift. A choice: an isolated building has no mode
there."""
FEWEST_BINS = 6
"""Bins that determine the drift's level at least, however short the record. A choice: a factor of three either way."""
SWAYING = (0.15, 0.6)
"""Hz, band of the flicker estimate: above the drift, below the first fixed-base mode of all but the softest
buildings."""
TRANSFER, TRANSIENT = 5, 3
"""Numbers of polynomial coefficients for a floor's transfer function and for its transient. A choice: as few as follow
the quasi-static deflection."""
COMMON_BASE = 2.0
"""Factor by which floors compared with one base slab hold less information than as many independent comparisons."""
CERTAIN_FLICKER = 4.0
"""Standard deviations by which the noise at low frequencies must exceed the white noise to count as flicker. A choice:
normal errors exceed them once in 30,000."""


def noise_std(samples: Matrix, rate: float) -> Vector:
    """Standard deviation of each channel's noise, white within the band that the record contains.

    The level is that of the spectrum above 15 Hz in the quietest fifth of the record, over the frequencies that no
    filter removed before. Where the structure never comes to rest, the result is an upper bound.

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
    """One-sided spectral density of each channel's noise within the band that the record contains.

    The level is that of the spectrum in the quietest fifth of the record, from 15 to 20 Hz: just above the structure's
    motion, and below the slopes of filters. Where the structure never comes to rest, the result is an upper bound.

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


def _quiet_spectra(samples: Matrix, rate: float) -> tuple[Vector, Matrix, MaskMatrix]:
    """(frequencies,) Hz, and (channels, frequencies) density of the quietest stretch and whether no filter removed
    it."""
    length = round(WINDOW * rate)
    if samples.shape[1] < FEWEST_WINDOWS * length:
        seconds = samples.shape[1] / rate
        raise RecordError(f"a record of {seconds:.3g} s is too short to estimate the noise; 10 s are needed")
    frequency, _, spectra = scipy.signal.spectrogram(samples, rate, nperseg=length, noverlap=length // 2, window="hann")
    density = np.array([_quiet_density(spectrum, _high(frequency, rate)) for spectrum in spectra])
    loud = np.quantile(density[:, _high(frequency, rate)], 0.75, axis=1, keepdims=True)
    return frequency, density, density >= FILTERED_AWAY * loud


def _high(frequency: Vector, rate: float) -> Mask:
    return np.asarray(frequency > min(STRUCTURE_ENDS, HIGH_SHARE * rate / 2))


def _quiet_density(spectrum: Matrix, high: Mask) -> Vector:
    """(frequencies,) mean of a (frequencies, times) spectrogram over the stretch with the least motion at high ones."""
    windows = max(1, round(QUIET * spectrum.shape[1]))
    running = ndimage.uniform_filter1d(spectrum[high].mean(axis=0), windows, mode="nearest")
    inside = running[windows // 2 : spectrum.shape[1] - (windows - 1) // 2]
    start = int(np.argmin(inside))
    return np.asarray(spectrum[:, start : start + windows].mean(axis=1))


def drifting_noise(power: Vector, frequency: Vector, white_noise: float) -> Vector:
    """(k,) power of an accelerometer's noise: white noise, and a drift that falls as 1/ω².

    Args:
        power: (k,) (m/s²)², periodogram of the acceleration, in which white noise has its variance in every bin.
        frequency: (k,) Hz, rising.
        white_noise: m/s², standard deviation.
    """
    lowest = slice(0, max(FEWEST_BINS, int(np.searchsorted(frequency, DRIFT_BELOW))))
    excess = np.mean((power[lowest] - white_noise**2) * frequency[lowest] ** 2)
    density: Vector = white_noise**2 + max(float(excess), 0.0) / frequency**2
    return density


def clear_band(power: Vector, noise: Vector, frequency: Vector) -> tuple[float, float] | None:
    """Hz, lowest and highest frequency of the band around the clearest line in which the record exceeds its noise.

    Integrated twice, white noise of density N becomes N/ω⁴ and a drift 1/ω⁶, while the displacement's own spectrum
    stays level or falls towards ω = 0: below some frequency the integral is noise, as a derivative is above some other.

    Args:
        power: (k,) smoothed periodogram of the record.
        noise: (k,) the same of its noise.
        frequency: (k,) Hz, rising.

    Returns:
        None if no frequency is clear of the noise.
    """
    ratio = power / np.maximum(noise, np.finfo(float).tiny)
    clearest = int(np.argmax(ratio))
    if ratio[clearest] < CLEAR:
        return None
    unclear = np.concatenate([[-1], np.flatnonzero(ratio < CLEAR), [ratio.size]])
    above = int(np.searchsorted(unclear, clearest))
    return float(frequency[unclear[above - 1] + 1]), float(frequency[unclear[above] - 1])


def flicker(frequency: Vector, corner: float) -> Vector:
    """(k,) power of noise with flicker over that of its white part, at frequencies above 0 Hz.

    The noise of an amplifier rises as 1/f below a corner.
    """
    return np.asarray(1 + corner / frequency)


def record_flicker(series: Matrix, rate: float) -> float:
    """Corner frequency as of `flicker_corner`, Hz, of (channels, n) accelerations: the base slab's, then floors'.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    count = series.shape[1]
    frequency = np.asarray(np.fft.rfftfreq(count, 1 / rate), dtype=float)
    white = noise_density(series, rate) * count * rate / 2
    return flicker_corner(np.fft.rfft(series, axis=1), white, frequency)


def flicker_corner(spectra: ComplexMatrix, noise: Vector, frequency: Vector) -> float:
    """Frequency at which the channels' flicker noise equals their white noise, Hz; 0 where white noise explains all.

    A quiet stretch of the record does not show it, since a building still sways there. But floors follow the base slab
    by one smooth transfer function, however strongly they move: their residual is the noise of both (the local
    polynomial method: Pintelon and Schoukens, 2012, System Identification, chapter 7).

    Args:
        spectra: (channels, k) discrete Fourier transform of the base slab's acceleration, then of floors'.
        noise: (channels,) mean square of that of each channel's white noise.
        frequency: (k,) Hz.
    """
    within = (frequency >= SWAYING[0]) & (frequency <= SWAYING[1])
    lines, f = spectra[:, within], frequency[within]
    free = f.size - TRANSFER - TRANSIENT
    if free < TRANSFER or len(lines) < 2 or not noise.all():
        return 0.0
    residual = _transfer_residual(lines, f)
    excess = np.abs(residual) ** 2 / (noise[1:] + noise[0])[:, None] * f.size / free - 1
    mean, certainty = float(excess.mean()), np.sqrt(excess.size * free / f.size / COMMON_BASE)
    return mean / float(np.mean(1 / f)) if mean * certainty > CERTAIN_FLICKER else 0.0


def _transfer_residual(lines: ComplexMatrix, frequency: Vector) -> ComplexMatrix:
    """(floors, k) residual of the floors after smooth transfer functions from the base slab and smooth transients."""
    at = np.interp(frequency, [frequency[0], frequency[-1]], [-1.0, 1.0])
    powers: Matrix = np.vander(at, max(TRANSFER, TRANSIENT), increasing=True)
    columns = np.hstack([powers[:, :TRANSFER] * lines[0][:, None], powers[:, :TRANSIENT] * np.abs(lines[0]).mean()])
    floors = lines[1:].T
    explained = columns @ np.linalg.lstsq(columns, floors, rcond=None)[0]
    return np.asarray((floors - explained).T)
