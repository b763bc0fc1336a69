"""Whitening of force histories to independent units of their noise.

The cosine transform of a record of stationary noise has nearly independent coefficients, each with the variance of the
noise's spectrum at its frequency (Brillinger 1981, theorem 4.4.1 for the Fourier transform). What lies below the band,
where an estimated force has no information, and above it, where the layer has no effect, is left out: of the
measured force and of a model's alike, which is a projection and no filter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.fft import dct, idct

from core.arrays import Matrix, Vector
from core.signals.conditioning import passed_share

BAND = (0.2, 12.5)
"""Hz: an analysis passes accelerations from 0.1 Hz, and isolators do nothing beyond."""
NEGLIGIBLE = 1e-5
"""Fraction of the measured force's power that may be omitted at high frequencies: it belongs to the superstructure's
higher modes rather than to the layer. Not tuned."""
AVERAGED = 41
"""Coefficients over which the force's power is averaged. A choice."""
LEAST_TOP = 3.0
"""Hz, that are kept in any case. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """The coefficients kept of one record, and the noise in each.

    Beside what is free at each frequency, the noise may have patterns: then its covariance, over the variances, is
    1 + Σ s² v vᵀ, and each pattern v is shrunk by √(1 + s²).
    """

    count: int
    """n, samples of the record."""
    rate: float
    """Hz."""
    kept: slice
    """Retained range of the n coefficients."""
    std: Vector
    """(m,) N, of the noise in each coefficient."""
    passed: Vector
    """(m,) share of each coefficient of the true force that the measured one retains."""
    patterns: Matrix
    """(p, m) v, orthonormal, over the std."""
    strengths: Vector
    """(p,) s, over the noise alone."""
    window: Vector
    """(n,) by which every history is multiplied first: less than 1 where the record is unreliable."""
    enlarged: float = 1.0
    """Factor by which the std has been enlarged. The patterns' s is then as many times smaller: they keep their size
    in N."""

    @property
    def frequency(self) -> Vector:
        """(m,) Hz."""
        return np.arange(self.kept.start, self.kept.stop) * self.rate / (2 * self.count)

    @property
    def _shrinking(self) -> Vector:
        """(p,) √(1 + s²) beside the enlarged std."""
        return np.asarray(np.sqrt(1 + (self.strengths / self.enlarged) ** 2))

    def of(self, series: Matrix) -> Matrix:
        """(k, m) independent units of the noise, of (k, n) series."""
        return self.whitened(self.coefficients(series))

    def coefficients(self, series: Matrix) -> Matrix:
        """(k, m) of (k, n) series, in their unit."""
        transformed: Matrix = dct(series * self.window, norm="ortho", axis=-1)[:, self.kept]
        return transformed

    def filtered(self, series: Matrix) -> Matrix:
        """(k, m) of (k, n) series in their unit, as the measured force holds them."""
        return np.asarray(self.coefficients(series) * self.passed)

    def whitened(self, coefficients: Matrix) -> Matrix:
        """(k, m) independent units of the noise, of (k, m) coefficients in N."""
        free = coefficients / self.std
        return np.asarray(free - (free @ self.patterns.T * (1 - 1 / self._shrinking)) @ self.patterns)

    def back(self, white: Vector) -> Vector:
        """(n,) N, the history within the band of (m,) independent units; still multiplied by the window."""
        return self.history((white + (self.patterns @ white * (self._shrinking - 1)) @ self.patterns) * self.std)

    def rms(self, white: Vector) -> float:
        """N, root mean square over the samples of (m,) independent units, each pattern shrunk as in the noise alone:
        the same whatever the factor of the std is."""
        own = self._shrinking / np.sqrt(1 + self.strengths**2)
        shrunk = white - (self.patterns @ white * (1 - own)) @ self.patterns
        return float(np.linalg.norm(shrunk * self.std) / np.sqrt(self.count))

    def history(self, coefficients: Vector) -> Vector:
        """(n,) the history of (m,) coefficients, in their unit; still multiplied by the window."""
        every = np.zeros(self.count)
        every[self.kept] = coefficients
        series: Vector = idct(every, norm="ortho")
        return series


def whitening(
    force: Vector,
    rate: float,
    density: Callable[[Vector], Vector],
    *,
    patterns: Matrix | None = None,
    passed: tuple[float, float] | None = None,
    window: Vector | None = None,
) -> Whitening:
    """By the spectrum of the noise.

    Args:
        force: (n,) N, as measured.
        rate: Hz.
        density: one-sided, N²/Hz, at (k,) frequencies in Hz.
        patterns: (p, n) N, what one standard deviation of each independent cause does to the force; None if none is
            known.
        passed: Hz, pass band of the measured force's filter; None without one.
        window: (n,) by which every history is multiplied first; None for 1.
    """
    count, per_hertz = force.size, 2 * force.size / rate
    first, least, last = (int(np.ceil(one * per_hertz)) for one in (BAND[0], LEAST_TOP, BAND[1]))
    seen = np.ones(count) if window is None else window
    beyond = np.cumsum(dct(force * seen, norm="ortho")[first:last][::-1] ** 2)[::-1]
    top = first + int(np.sum(beyond > NEGLIGIBLE * beyond[0]))
    kept = slice(first, min(count, max(least, top)))
    frequency = np.arange(kept.start, kept.stop) * rate / (2 * count)
    share = np.ones(frequency.size) if passed is None else passed_share(frequency, rate, passed)
    std = np.sqrt(density(frequency) * rate / 2 * np.mean(seen**2))
    given = np.zeros((0, count)) if patterns is None else patterns
    _, strengths, unit = np.linalg.svd(dct(given * seen, norm="ortho", axis=-1)[:, kept] / std, full_matrices=False)
    return Whitening(count, rate, kept, std, share, unit, strengths, seen)


def shrunk(weights: Whitening, force: Vector, density: Callable[[Vector], Vector]) -> Whitening:
    """For a force that is a posterior mean: of a frequency it holds S / (S + P), its power over the true force's.

    A model's force is shrunk alike; otherwise the little that is estimated at high frequencies would be mistaken for a
    property of the layer, above all an inertance (Wiener 1949; the regression of what is estimated on what is true).

    Args:
        weights: not yet shrunk.
        force: (n,) N, as estimated.
        density: P, one-sided, N²/Hz, of the estimate's error at (k,) frequencies in Hz.
    """
    power = ndimage.uniform_filter1d(weights.coefficients(force[None])[0] ** 2, AVERAGED, mode="nearest")
    noise = density(weights.frequency) * weights.rate / 2 * np.mean(weights.window**2)
    share = power / (power + noise)
    return replace(weights, passed=weights.passed * share)


def reweighted(whitenings: Sequence[Whitening], residuals: Sequence[Vector]) -> tuple[Whitening, ...]:
    """By what a model left over where that is more than the noise: record by record, in all coefficients alike.

    No weighing by the residual's spectrum: what a model lacks lies where the layer works, and would be played down. The
    patterns keep their size in N: what a model lacks makes no clock later and no mass larger.

    Args:
        whitenings: that the residuals were whitened by.
        residuals: (m,) of each record.
    """
    grown = [max(1.0, float(np.sqrt(np.mean(white**2)))) for white in residuals]
    return tuple(
        replace(old, std=old.std * factor, enlarged=old.enlarged * factor)
        for old, factor in zip(whitenings, grown, strict=True)
    )
