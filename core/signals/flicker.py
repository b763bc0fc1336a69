"""How much stronger is accelerometers' noise at low frequencies than at high ones?

The noise of an amplifier rises as 1/f below a corner. A record's quiet stretch does not show it there, since a building
still sways. But floors that move by one smooth transfer from the base slab say the same as it does, but for the
noise of both: what is left of them beside that transfer is noise, however strongly they moved (the local polynomial
method: Pintelon and Schoukens, 2012, System Identification, chapter 7).
"""

import numpy as np

from core.arrays import ComplexMatrix, Matrix, Vector
from core.signals.noise import noise_density

SWAYING = (0.15, 0.6)
"""Hz, below the first fixed-base mode of all but the softest buildings."""
TRANSFER, TRANSIENT = 5, 3
"""Coefficients of the polynomials for a floor's transfer, and for what the record's ends leave."""
CORRELATED = 2.0
"""By how much floors that are compared with one base slab say less of the noise than as many comparisons apart."""
CERTAIN = 4.0
"""Standard deviations by which the noise there must exceed its level at high frequencies to count as flicker."""


def flicker(frequency: Vector, corner: float) -> Vector:
    """(k,) power of noise with flicker over that of its white part, at frequencies in Hz above 0."""
    return np.asarray(1 + corner / frequency)


def record_flicker(series: Matrix, rate: float) -> float:
    """Hz, the corner as of `flicker_corner`, of (channels, n) accelerations: the base slab's, then floors'.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    count = series.shape[1]
    frequency = np.asarray(np.fft.rfftfreq(count, 1 / rate), dtype=float)
    white = noise_density(series, rate) * count * rate / 2
    return flicker_corner(np.fft.rfft(series, axis=1), white, frequency)


def flicker_corner(spectra: ComplexMatrix, noise: Vector, frequency: Vector) -> float:
    """Hz, at which the channels' flicker noise is as strong as their white noise; 0 where white noise explains all.

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
    left = _beside_transfer(lines, f)
    excess = np.abs(left) ** 2 / (noise[1:] + noise[0])[:, None] * f.size / free - 1
    mean, certainty = float(excess.mean()), np.sqrt(excess.size * free / f.size / CORRELATED)
    return mean / float(np.mean(1 / f)) if mean * certainty > CERTAIN else 0.0


def _beside_transfer(lines: ComplexMatrix, frequency: Vector) -> ComplexMatrix:
    """(floors, k) what is left of the floors beside smooth transfers from the base slab and smooth transients."""
    at = np.interp(frequency, [frequency[0], frequency[-1]], [-1.0, 1.0])
    powers: Matrix = np.vander(at, max(TRANSFER, TRANSIENT), increasing=True)
    columns = np.hstack([powers[:, :TRANSFER] * lines[0][:, None], powers[:, :TRANSIENT] * np.abs(lines[0]).mean()])
    floors = lines[1:].T
    told = columns @ np.linalg.lstsq(columns, floors, rcond=None)[0]
    return np.asarray((floors - told).T)
