"""Spectral lines of a record: its discrete Fourier transform with the noise in it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import ndimage

from core.arrays import ComplexMatrix, Indices, Matrix, Vector
from core.estimators.superstructure import InstrumentedSuperstructure
from core.signals.noise import flicker, flicker_corner, noise_density

BANDS = np.geomspace(0.3, 25.0, 16)
"""Hz, limits between the bands in each of which unmodelled motion has one strength. A choice."""
AT_REST = 0.02
"""Share of the largest root mean square over EDGE; a record's end no further above the quietest is at rest. A
choice."""
LOWEST = 0.1
"""Hz, below which the noise is assumed not to rise further: slower parts are filtered out of records."""
NOISELESS = 1e-6
"""Share of a channel's power below which its noise is not set: with less the misfit has too many local minima."""
EDGE = 0.5
"""s, window by which rest at the record's ends is judged. A choice."""
NEIGHBOURS = 21
"""Lines over which the spectrum of the base slab's motion is averaged. A choice."""
QUIETEST = 0.02
"""Share of the record that counts as noise alone in judging rest. A choice."""


@dataclass(frozen=True, eq=False)  # without slots, for the cached properties
class Lines:
    """Spectral lines of a record, all of them or those that calibration uses."""

    angular: Vector
    """(lines,) rad/s."""
    spectra: ComplexMatrix
    """(channels, lines) discrete Fourier transform, the base slab first."""
    noise: Vector
    """(channels,) mean square of the transform of the noise's white part."""
    colour: Vector
    """(lines,) power of all noise over that of its white part."""
    band: Indices
    """(lines,) index of the frequency band, for variances."""
    samples: int
    rate: float
    at_rest: bool
    """True if the record begins and ends at rest, so that no free vibration has to be estimated."""

    def every(self, stride: int) -> "Lines":
        """Every `stride`-th line, counted from the last, so that the highest band keeps lines."""
        return self.chosen(np.arange(self.angular.size - 1, -1, -stride)[::-1])

    def chosen(self, places: Indices | slice) -> "Lines":
        """Only the lines at these places."""
        return replace(
            self,
            angular=self.angular[places],
            spectra=np.ascontiguousarray(self.spectra[:, places]),  # numpy lays out a choice of columns by columns
            colour=self.colour[places],
            band=self.band[places],
        )

    @property
    def noise_at(self) -> Matrix:
        """(channels, lines) mean square of the noise's transform."""
        return self.noise[:, None] * self.colour

    @cached_property
    def scale(self) -> Matrix:
        """(channels, lines) inverse of the noise's root mean square: a spectrum times it is in units of noise."""
        return np.asarray(1 / np.sqrt(self.noise_at))

    @cached_property
    def base_power(self) -> Vector:
        """(lines,) mean square of the base slab's transform without noise, averaged over NEIGHBOURS."""
        power = ndimage.uniform_filter1d(np.abs(self.spectra[0]) ** 2, NEIGHBOURS, mode="nearest")
        return np.asarray(np.maximum(power - self.noise_at[0], 1e-3 * power))

    @cached_property
    def scaled(self) -> ComplexMatrix:
        """(channels, lines) the spectra in units of noise."""
        return np.asarray(self.scale * self.spectra)


def spectral_lines(superstructure: InstrumentedSuperstructure) -> Lines:
    """All of the record's spectrum."""
    series = np.vstack([superstructure.base_acceleration, superstructure.floor_acceleration])
    samples, rate = series.shape[1], superstructure.rate
    frequency = np.asarray(np.fft.rfftfreq(samples, 1 / rate), dtype=float)
    angular = np.asarray(2 * np.pi * frequency)
    spectra = np.fft.rfft(series, axis=1)
    power = np.mean(np.abs(spectra) ** 2, axis=1)
    angular[0] = 1e-3 * angular[1]  # the response at rest is the limit, not 0 / 0
    noise = np.maximum(noise_density(series, rate) * samples * rate / 2, NOISELESS * power)
    corner = flicker_corner(spectra, noise, frequency)
    return Lines(
        angular=angular,
        spectra=spectra,
        noise=noise,
        colour=flicker(np.maximum(frequency, LOWEST), corner),
        band=np.digitize(frequency, BANDS),
        samples=samples,
        rate=rate,
        at_rest=_is_at_rest(series, rate),
    )


def within(lines: Lines, band: tuple[float, float]) -> Lines:
    """The lines of a band of frequencies in Hz."""
    inside = (lines.angular > 2 * np.pi * band[0]) & (lines.angular < 2 * np.pi * band[1])
    return lines.chosen(np.flatnonzero(inside))


def _is_at_rest(series: Matrix, rate: float) -> bool:
    window = max(1, round(EDGE * rate))
    energy = np.array([np.convolve(row**2, np.full(window, 1 / window), mode="valid") for row in series])
    ends = np.maximum(energy[:, 0], energy[:, -1])
    quiet = np.quantile(energy, QUIETEST, axis=1)
    return bool(np.all(ends - quiet < AT_REST**2 * energy.max(axis=1)))
