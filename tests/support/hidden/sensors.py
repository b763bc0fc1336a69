"""Sensors: sampling and noise in the building's channels."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.signal import resample_poly

from core.arrays import Vector

RATE = 100.0
"""Hz, of the records."""
RESOLUTION = 1e-5
"""m, of the usual displacement sensor: its step, and the standard deviation of its noise."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of the sensors."""

    level: float
    """Standard deviation of an accelerometer's noise, over the channel's root mean square in the event."""
    pink: float = 0.0
    """Share of its power that falls with frequency as 1/f; the rest is white."""
    resolution: float = RESOLUTION
    """m, of the displacement sensor."""


def sampled(exact: Vector, rate: float) -> Vector:
    """The series at RATE, low-passed without delay as a digitiser does."""
    ratio = Fraction(RATE / rate).limit_denominator(10000)
    return np.asarray(resample_poly(exact, ratio.numerator, ratio.denominator, axis=-1))


def noise(noise: Noise, rms: float, count: int, rng: np.random.Generator) -> Vector:
    """(count,) of an accelerometer on a channel of that root mean square."""
    white, pink = rng.standard_normal(count), _pink(rng.standard_normal(count))
    return np.asarray(noise.level * rms * (np.sqrt(1 - noise.pink) * white + np.sqrt(noise.pink) * pink))


def displacement_reading(exact: Vector, resolution: float, rng: np.random.Generator) -> Vector:
    """m, with noise of that standard deviation in m, in whole steps of it."""
    return np.asarray(np.round((exact + resolution * rng.standard_normal(exact.size)) / resolution) * resolution)


def late(samples: Vector, delay: float) -> Vector:
    """The band-limited series of a clock that is late by so many seconds; what lies outside is its end's."""
    return shifted(samples, np.clip(np.arange(samples.size) - delay * RATE, 0, samples.size - 1))


def shifted(samples: Vector, at: Vector) -> Vector:
    """The band-limited series between its samples, at places counted in samples."""
    fine = 16
    lines = np.fft.rfft(np.concatenate([samples, samples[::-1]]))
    count = 2 * samples.size * fine
    dense = np.fft.irfft(np.pad(lines, (0, count // 2 + 1 - lines.size)), count)[: samples.size * fine] * fine
    return np.interp(at * fine, np.arange(dense.size), dense)


def _pink(white: Vector) -> Vector:
    """The noise with its power made proportional to 1/f, of variance 1."""
    lines = np.fft.rfft(white)
    lines[1:] /= np.sqrt(np.arange(1, lines.size))
    lines[0] = 0.0
    pink = np.fft.irfft(lines, white.size)
    return np.asarray(pink / pink.std())
