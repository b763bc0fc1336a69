"""At which frequencies does a record stand clear of its noise?

Integrated twice, white noise of density N becomes N/ω⁴ and a drift (density 1/ω²) 1/ω⁶, while the displacement's
own spectrum stays level or falls towards ω = 0. Below some frequency the integral is therefore noise, as above some
frequency a derivative is. Both are taken where the record's spectrum stands three times above the noise's, the signal
then being twice the noise (after Boore and Bommer, 2005, "Processing of strong-motion accelerograms", Soil Dynamics
and Earthquake Engineering 25, 93-115, who choose the filters' corners so).
"""

import numpy as np

from core.arrays import Vector

CLEAR = 9.0
"""Power of the record over that of its noise from which on the signal is used: amplitudes are as 3 to 1."""
DRIFT_BELOW = 0.03
"""Hz: what an accelerometer holds below this is taken for its drift, whatever it is."""
FEWEST_BINS = 6
"""Of the spectrum, from which the drift's level is told, however short the record."""
SMOOTHING = 2 ** (1 / 4)
"""Factor in frequency, either way, over which a spectrum is averaged."""


def drifting_noise(power: Vector, frequency: Vector, white_noise: float) -> Vector:
    """(k,) power of an accelerometer's noise: white, and a drift that falls as 1/ω².

    Args:
        power: (k,) (m/s²)², periodogram of the acceleration; white noise has its variance in every bin.
        frequency: (k,) Hz, rising.
        white_noise: m/s², standard deviation.
    """
    lowest = slice(0, max(FEWEST_BINS, int(np.searchsorted(frequency, DRIFT_BELOW))))
    excess = np.mean((power[lowest] - white_noise**2) * frequency[lowest] ** 2)
    density: Vector = white_noise**2 + max(float(excess), 0.0) / frequency**2
    return density


def smoothed(power: Vector, frequency: Vector) -> Vector:
    """(k,) mean of a periodogram over half an octave about each frequency, of five bins at least."""
    bins = np.arange(power.size)
    first = np.minimum(np.searchsorted(frequency, frequency / SMOOTHING), np.maximum(bins - 2, 0))
    last = np.maximum(np.searchsorted(frequency, frequency * SMOOTHING), np.minimum(bins + 3, power.size))
    total = np.concatenate([[0.0], np.cumsum(power)])
    return np.asarray((total[last] - total[first]) / (last - first))


def clear_band(power: Vector, noise: Vector, frequency: Vector) -> tuple[float, float] | None:
    """Hz, lowest and highest frequency between which the record is clear of its noise, about where it is clearest.

    Args:
        power: (k,) smoothed periodogram of the record.
        noise: (k,) that of its noise.
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
