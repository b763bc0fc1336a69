"""How does a history of force read in independent units of its noise?

The cosine transform of a record of stationary noise has nearly independent coefficients, each with the variance of the
noise's spectrum at its frequency (Brillinger 1981, theorem 4.4.1 for the Fourier transform). What lies below the band,
where an estimated force knows nothing, and above it, where the layer does nothing, is left out: of the measured force
and of a model's alike, which is a projection and no filter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import dct, idct

from core.arrays import Matrix, Vector
from core.conditioning import passed_share

BAND = (0.2, 12.5)
"""Hz: an analysis passes accelerations from 0.1 Hz, and isolators do nothing beyond."""
NEGLIGIBLE = 1e-5
"""Of the measured force's power: what lies beyond the frequency above which there is no more is left out too, as it is
the superstructure's higher modes rather than the layer."""
LEAST_TOP = 3.0
"""Hz, that are kept in any case."""


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """The coefficients kept of one record, and the noise in each."""

    count: int
    """n, samples of the record."""
    rate: float
    """Hz."""
    kept: slice
    """Of the n coefficients."""
    std: Vector
    """(m,) N, of the noise in each coefficient."""
    passed: Vector
    """(m,) share of each that the measured force's filter let pass."""

    @property
    def frequency(self) -> Vector:
        """(m,) Hz."""
        return np.arange(self.kept.start, self.kept.stop) * self.rate / (2 * self.count)

    def of(self, series: Matrix) -> Matrix:
        """(k, m) coefficients of (k, n) series, over their noise."""
        return np.asarray(self.coefficients(series) / self.std)

    def coefficients(self, series: Matrix) -> Matrix:
        """(k, m) of (k, n) series, in their unit."""
        transformed: Matrix = dct(series, norm="ortho", axis=-1)[:, self.kept]
        return transformed

    def filtered(self, series: Matrix) -> Matrix:
        """(k, m) of (k, n) series in their unit, as the measured force's filter lets them pass."""
        return np.asarray(self.coefficients(series) * self.passed)

    def back(self, white: Vector) -> Vector:
        """(n,) N, the history within the band of (m,) whitened coefficients."""
        coefficients = np.zeros(self.count)
        coefficients[self.kept] = white * self.std
        series: Vector = idct(coefficients, norm="ortho")
        return series


def whitening(
    force: Vector, rate: float, density: Callable[[Vector], Vector], passed: tuple[float, float] | None = None
) -> Whitening:
    """By the spectrum of the noise.

    Args:
        force: (n,) N, as measured.
        rate: Hz.
        density: one-sided, N²/Hz, at (k,) frequencies in Hz.
        passed: Hz, pass band of the filter that the measured force went through; None if there was none.
    """
    count, per_hertz = force.size, 2 * force.size / rate
    first, least, last = (int(np.ceil(one * per_hertz)) for one in (BAND[0], LEAST_TOP, BAND[1]))
    beyond = np.cumsum(dct(force, norm="ortho")[first:last][::-1] ** 2)[::-1]
    top = first + int(np.sum(beyond > NEGLIGIBLE * beyond[0]))
    kept = slice(first, min(count, max(least, top)))
    frequency = np.arange(kept.start, kept.stop) * rate / (2 * count)
    share = np.ones(frequency.size) if passed is None else passed_share(frequency, rate, passed)
    return Whitening(count, rate, kept, np.sqrt(density(frequency) * rate / 2), share)


def reweighted(whitenings: Sequence[Whitening], residuals: Sequence[Vector]) -> tuple[Whitening, ...]:
    """By what a model left over where that is more than the noise: record by record, in all coefficients alike.

    No weighing by the residual's spectrum: what a model lacks lies where the layer works, and would be played down.

    Args:
        whitenings: that the residuals were whitened by.
        residuals: (m,) of each record.
    """
    return tuple(
        replace(old, std=old.std * max(1.0, float(np.sqrt(np.mean(white**2)))))
        for old, white in zip(whitenings, residuals, strict=True)
    )
