"""Slow motion restored to a displacement that was integrated from accelerations through a high-pass.

Whoever integrates accelerations removes their drift with a high-pass, and the layer's slow motion with it. Two things
still show it: the accelerations themselves, above their drift, and the channel, of whose slow motion a known share is
left. The best estimate by both is that of a Gaussian process e, the slow motion that the channel lacks: its second
derivative is the difference of the accelerations and the channel's, and the high-pass of channel and e together is the
channel. Beyond the record's ends e is unknown, so that a record which was cut does little harm. If the accelerations
had no drift, the result would be their integral X = −A/ω² · q/(1 + q), q = (f / LOWEST)⁸.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from scipy import linalg

from core.arrays import Mask, Matrix, Vector

LOWEST = 0.06
"""Hz, below which no slow motion is sought. From 0.05 to 0.08 a model of the real building fits alike."""
POWERS = (4, 8, 16)
"""Exponents q = (f / corner)^power of the high-passes that are recognised, which are those of Butterworth filters of
order 2, 4 and 8, forwards and backwards."""
CORNERS = (0.1, 0.6)
"""Hz, range of corners that are recognised: usual high-passes of acceleration processing. A choice."""
COMPARED = (0.1, 2.0)
"""Hz, range in which channel and filtered integral are compared; below, drift and the record's ends disturb."""
RECOGNISED = 0.05
"""Largest rms difference, over the channel's rms, of the channel and the filtered integral of a recognised high-pass. A
choice: 0.001 to 0.033 in the records of the real building, one of which was cut; 0.15 where a filter has phase."""
SLOW = 0.45
"""Hz, up to which slow motion is compared. A choice."""
FASTEST = 0.3
"""Hz, up to which the channel may lack motion, at least; twice the corner if that is more."""
INTERVAL = 0.5
"""s, between samples of the slow motion, whose frequencies are below `SLOW`. A choice."""
BEYOND = 40.0
"""s, beyond each end of the record: two and a half periods of LOWEST."""
END = 1.0
"""s, at each end of the record, in which low-passed accelerations are not compared. A choice."""
DRIFT = 0.02
"""m/s², standard deviation of the accelerations' slow error at each sample of the slow motion. Chosen on the real
building, one of whose records was cut: a model fits the three alike from 0.01 to 0.02, and the cut one worse below."""
UNFOLLOWED = 4e-3
"""Standard deviation of the channel's error over its rms. A choice: rounding, and what the recognised filter leaves."""
LEAST = 1e-6
"""Smallest power of the slow motion at any frequency, over its largest: matrices stay regular."""
MOST_SAMPLES = 3000
"""Samples of the slow motion at most: 23 minutes, since matrices of that size are solved."""


@dataclass(frozen=True, slots=True)
class HighPass:
    """High-pass without phase, of gain q / (1 + q) with q = (f / corner)^power."""

    corner: float
    """Hz."""
    power: int

    def gain(self, frequency: Vector) -> Vector:
        """Its gain at frequencies in Hz."""
        ratio = (frequency / self.corner) ** self.power
        return np.asarray(ratio / (1 + ratio))


@dataclass(frozen=True, slots=True, eq=False)
class Restored:
    """A displacement with its slow motion."""

    displacement: Vector
    """(n,) m."""
    velocity: Vector
    """(n,) m/s."""
    std: Vector
    """(n,) m, standard deviation of the slow motion."""
    high_pass: HighPass
    """The filter that was undone."""


def high_pass_of(displacement: Vector, relative_acceleration: Vector, rate: float) -> HighPass | None:
    """The high-pass through which accelerations were integrated; None if it is not one that is recognised.

    Args:
        displacement: (n,) m, the integral.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
    """
    count = _padded(displacement.size)
    frequency: Vector = np.asarray(np.fft.rfftfreq(count, 1 / rate))
    integral = _integral(relative_acceleration, frequency, count)
    channel = np.fft.rfft(displacement - displacement.mean(), count)
    near = (frequency > COMPARED[0]) & (frequency < COMPARED[1])
    size = float(np.linalg.norm(channel[near]))

    def off(log_corner: float, power: int) -> float:
        filtered = HighPass(float(np.exp(log_corner)), power).gain(frequency[near]) * integral[near]
        return float(np.linalg.norm(filtered - channel[near])) / size

    bounds = tuple(np.log(CORNERS))
    fitted = {
        power: scipy.optimize.minimize_scalar(off, bounds=bounds, args=(power,), method="bounded") for power in POWERS
    }
    power = min(fitted, key=lambda one: float(fitted[one].fun))
    best = fitted[power]
    return HighPass(float(np.exp(best.x)), power) if best.fun < RECOGNISED else None


def restored(displacement: Vector, relative_acceleration: Vector, rate: float) -> Restored | None:
    """The displacement with the slow motion that a high-pass removed; None if the high-pass is not recognised.

    Args:
        displacement: (n,) m, integrated from the accelerations.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.

    Returns:
        None also for a record of more than MOST_SAMPLES.
    """
    stride = max(1, round(INTERVAL * rate))
    margin = round(BEYOND * rate)
    samples = -(-(displacement.size + 2 * margin) // stride)
    if samples > MOST_SAMPLES or (found := high_pass_of(displacement, relative_acceleration, rate)) is None:
        return None
    own = slice(margin, margin + displacement.size)
    time = np.arange(displacement.size) / rate
    lacking = relative_acceleration - scipy.interpolate.CubicSpline(time, displacement)(time, 2)
    frequency: Vector = np.asarray(np.fft.rfftfreq(samples * stride, 1 / rate))
    # a high-pass leaves no mean; the one that is there is of the record's baseline
    centred = displacement - displacement.mean()
    channel, bent = (_within(row, own, samples * stride) for row in (centred, lacking - lacking.mean()))
    removed = channel - np.fft.irfft(np.fft.rfft(channel) * found.gain(frequency), samples * stride)
    seen = [
        np.fft.irfft(np.fft.rfft(row) * _low_pass(frequency), samples * stride)[::stride] for row in (bent, removed)
    ]
    at = np.arange(samples) * stride
    inside = (at >= own.start + END * rate) & (at < own.stop - END * rate)
    slow, std = _slow_motion(seen, inside, found, stride / rate, float(displacement.std()))
    added = _resampled(slow, stride)[own]
    complete = centred + added
    velocity = scipy.interpolate.CubicSpline(time, complete)(time, 1)
    return Restored(complete, velocity, np.interp(np.arange(own.start, own.stop), at, std), found)


def _slow_motion(
    seen: list[Vector], inside: Mask, found: HighPass, interval: float, size: float
) -> tuple[Vector, Vector]:
    """(m,) m, the slow motion that the channel lacks, and its standard deviation.

    Args:
        seen: (m,) m/s² and (m,) m: bends of it by the accelerations, and what of it the channel shows.
        inside: (m,) True within the record.
        found: the high-pass of the channel.
        interval: s, between samples.
        size: m, standard deviation of the channel.
    """
    count = inside.size
    frequency: Vector = np.asarray(np.fft.rfftfreq(count, interval))
    low = _low_pass(frequency)
    bends = _circulant(-((2 * np.pi * frequency) ** 2) * low, count)[inside] / DRIFT
    follows = _circulant(found.gain(frequency) * low, count)[inside] / (UNFOLLOWED * size)
    fastest = max(FASTEST, 2 * found.corner)
    power = HighPass(LOWEST, 8).gain(frequency) / (1 + (frequency / fastest) ** 8)
    prior = _circulant(1 / (size**2 * np.maximum(power, LEAST)), count)
    covariance = linalg.inv(prior + bends.T @ bends + follows.T @ follows)
    pulled = bends.T @ seen[0][inside] / DRIFT + follows.T @ seen[1][inside] / (UNFOLLOWED * size)
    return covariance @ pulled, np.sqrt(np.diag(covariance))


def _padded(size: int) -> int:
    return int(2 ** np.ceil(np.log2(4 * size)))


def _integral(acceleration: Vector, frequency: Vector, count: int) -> Vector:
    """Spectrum of the double integral of a series that is zero beyond its ends."""
    integral = np.fft.rfft(acceleration - acceleration.mean(), count)
    integral[1:] /= -((2 * np.pi * frequency[1:]) ** 2)
    integral[0] = 0.0
    return np.asarray(integral)


def _low_pass(frequency: Vector) -> Vector:
    return np.asarray(1 / (1 + (frequency / SLOW) ** 16))


def _within(row: Vector, own: slice, count: int) -> Vector:
    placed = np.zeros(count)
    placed[own] = row
    return placed


def _circulant(gain: Vector, count: int) -> Matrix:
    """(count, count) filter of an even gain at the frequencies of rfft."""
    return np.asarray(linalg.circulant(np.fft.irfft(gain, count)))


def _resampled(slow: Vector, stride: int) -> Vector:
    """Samples between those of a band-limited series."""
    lines = np.zeros(slow.size * stride // 2 + 1, dtype=complex)
    own = np.fft.rfft(slow)
    lines[: own.size] = own * stride
    return np.fft.irfft(lines, slow.size * stride)
