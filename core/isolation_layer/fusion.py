"""Motion of the isolation layer from a displacement transducer, from accelerometers, or from both."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from core.arrays import Vector
from core.errors import RecordError
from core.isolation_layer.motion import MeasuredMotion, ResidualDisplacement
from core.signals.noise import clear_band, drifting_noise, flicker
from core.signals.regression import mean_with_std
from core.signals.spectra import (
    falling_line,
    sine_coefficients,
    sine_frequencies,
    sine_power,
    sine_variances,
    smoothed,
    sum_with_line,
)

START, END = 2.0, 10.0
"""s, longest beginning and end of the record whose means give the residual displacement. A choice: 10 s are several
periods of the layer."""
START_SHARE, END_SHARE = 0.02, 0.1
"""Largest shares of the record for beginning and end. A choice: 2 s and 10 s of a record of 100 s."""
END_MEAN = 0.05
"""s, at each end of the record, whose mean is the end of the straight line. Not tuned: the layer barely moves in it."""
FILTER_POWER = 8
"""Exponent of the squared gain of a Butterworth filter of order 4, which is its gain forwards and backwards."""


def fuse(
    displacement: Vector,
    relative_acceleration: Vector,
    rate: float,
    *,
    displacement_noise: float,
    acceleration_noise: float,
    corner: float = 0.0,
) -> MeasuredMotion:
    """Displacement and velocity by Wiener fusion of a displacement and an acceleration record.

    At each frequency the two are averaged with the inverse variances of their noise as weights,
    X = (X_d/σ_d² − ω² A/σ_a²) / (1/σ_d² + ω⁴/σ_a²): the transducer dominates below ω = √(σ_a/σ_d), the accelerometers
    above. Lasting displacements (a residual offset, a slow drift of the layer) therefore come from the transducer
    alone. The remaining variance at each frequency is 1 / (1/σ_d² + ω⁴/σ_a²); towards the record's ends, that of the
    line between them is added.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
        displacement_noise: m, standard deviation of the transducer's white noise.
        acceleration_noise: m/s², the same of the relative acceleration.
        corner: Hz, at which the flicker noise of the relative acceleration equals its white noise.

    Raises:
        RecordError: the two histories differ in length, or contain NaN.
    """
    if displacement.shape != relative_acceleration.shape:
        raise RecordError(
            f"the displacement has {displacement.size} samples, the acceleration {relative_acceleration.size}; "
            "put both on one time base"
        )
    _refuse_nan(displacement, relative_acceleration)
    line = _line_between_the_ends(displacement, rate)
    ω = sine_frequencies(displacement.size, rate)
    trust = np.zeros_like(ω)
    if acceleration_noise > 0:
        rising = flicker(ω / (2 * np.pi), corner)
        trust = ω**4 * (displacement_noise / acceleration_noise) ** 2 / rising
    X_d = sine_coefficients(displacement - line)
    X_a = -sine_coefficients(relative_acceleration - relative_acceleration.mean()) / ω**2
    fused, velocity = sum_with_line((X_d + trust * X_a) / (1 + trust), line, rate)
    variances = sine_variances(displacement_noise**2 / (1 + trust), ω)
    ends = _variances_of_the_line(trust / (1 + trust), displacement_noise, rate)
    std, velocity_std = (np.sqrt(one + end) for one, end in zip(variances, ends, strict=True))
    noise = displacement_noise * float(np.sqrt(np.mean(1 / (1 + trust))))
    residual = residual_displacement(displacement, rate)
    return MeasuredMotion(fused, velocity, std, velocity_std, (0.0, rate / 2), noise, residual)


def differentiate(displacement: Vector, rate: float, *, displacement_noise: float) -> MeasuredMotion | None:
    """Displacement and velocity from a transducer alone, up to the frequency where it is clear of its noise.

    Above that frequency the history is damped as by a Butterworth filter of order 4 (zero phase). The standard
    deviation is that of the noise which passes the filter, and of the motion which does not: the acceleration above the
    corner is assumed as strong as in the octave below.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        rate: Hz.
        displacement_noise: m, standard deviation of the transducer's white noise.

    Returns:
        None if the displacement is nowhere clear of its noise.

    Raises:
        RecordError: the history contains NaN.
    """
    _refuse_nan(displacement)
    line = _line_between_the_ends(displacement, rate)
    ω = sine_frequencies(displacement.size, rate)
    sines = sine_coefficients(displacement - line)
    frequency = ω / (2 * np.pi)
    power = smoothed(sine_power(sines), frequency)
    noise = displacement_noise**2 * (1 + smoothed(_power_of_the_line(displacement.size, rate), frequency))
    band = clear_band(power, noise, frequency)
    if band is None:
        return None
    corner = band[1]
    low_pass = 1 / (1 + (frequency / corner) ** FILTER_POWER)
    smooth, velocity = sum_with_line(sines * low_pass, line, rate)
    signal = np.maximum(power - noise, 0.0)
    octave = (frequency > corner / 2) & (frequency <= corner)
    beyond = np.where(frequency > corner, np.mean((signal * ω**4)[octave]) / ω**4, signal)
    density = displacement_noise**2 * low_pass**2 + beyond * (1 - low_pass) ** 2
    ends = _variances_of_the_line(1 - low_pass, displacement_noise, rate)
    std, velocity_std = (np.sqrt(one + end) for one, end in zip(sine_variances(density, ω), ends, strict=True))
    residual = residual_displacement(displacement, rate)
    passed = displacement_noise * float(np.sqrt(np.mean(low_pass**2)))
    return MeasuredMotion(smooth, velocity, std, velocity_std, (0.0, corner), passed, residual)


def integrate(
    relative_acceleration: Vector, rate: float, *, acceleration_noise: float, corner: float = 0.0
) -> MeasuredMotion | None:
    """Displacement and velocity by double integration of the relative acceleration, where it is clear of its noise.

    The integral is damped below the lowest clear frequency (`core.signals.noise.clear_band`) as by a Butterworth filter
    of order 4 (zero phase): a residual offset and all slower motion are lost. The standard deviation is that of the
    noise, white and drifting, that passes the filter, and of the motion that does not: below the corner its spectrum is
    assumed as high as in the octave above, as far as the record allows, and its variance to follow the motion.

    Args:
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
        acceleration_noise: m/s², standard deviation of the relative acceleration's white noise.
        corner: Hz, at which its flicker noise equals its white noise; it affects the standard deviation alone.

    Returns:
        None if the acceleration is nowhere clear of its noise.

    Raises:
        RecordError: the history contains NaN.
    """
    _refuse_nan(relative_acceleration)
    ω = sine_frequencies(relative_acceleration.size, rate)
    sines = sine_coefficients(relative_acceleration - relative_acceleration.mean())
    periodogram, frequency = sine_power(sines), ω / (2 * np.pi)
    noise = drifting_noise(periodogram, frequency, acceleration_noise)
    power = smoothed(periodogram, frequency)
    band = clear_band(power, noise, frequency)
    if band is None:
        return None
    lowest = band[0]
    high_pass = 1 / (1 + (lowest / frequency) ** FILTER_POWER)
    moved, velocity = sum_with_line(-sines / ω**2 * high_pass, np.zeros_like(relative_acceleration), rate)
    damping = (high_pass / ω**2) ** 2
    left, rising = noise * damping, acceleration_noise**2 * (flicker(frequency, corner) - 1) * damping
    passed = sine_variances(left + rising, ω)
    signal = np.maximum(power - noise, 0.0) / ω**4
    level = np.mean(signal[(frequency >= lowest) & (frequency < 2 * lowest)])
    slow = np.where(frequency < lowest, np.minimum(level, power / ω**4), signal)
    lost = sine_variances((1 - high_pass) ** 2 * slow, ω)
    envelope = _envelope(moved, rate / lowest)
    std, velocity_std = (np.sqrt(one + other * envelope) for one, other in zip(passed, lost, strict=True))
    return MeasuredMotion(moved, velocity, std, velocity_std, (lowest, rate / 2), float(np.sqrt(left.mean())))


def residual_displacement(displacement: Vector, rate: float) -> ResidualDisplacement:
    """Mean of the record's end less mean of its start, from a transducer's (n,) m at a rate in Hz.

    The standard deviation counts motion there as an autocorrelated process, so that a record which is cut in motion
    determines the position at rest poorly.
    """
    first, last = (
        max(2, round(min(length * rate, share * displacement.size)))
        for length, share in ((START, START_SHARE), (END, END_SHARE))
    )
    (before, before_std), (after, after_std) = (
        mean_with_std(part) for part in (displacement[:first], displacement[-last:])
    )
    return ResidualDisplacement(after - before, float(np.hypot(before_std, after_std)))


def _refuse_nan(*histories: Vector) -> None:
    if not all(np.isfinite(history).all() for history in histories):
        raise RecordError("the displacement or acceleration contains NaN; mend or cut the gaps first")


def _envelope(displacement: Vector, samples: float) -> Vector:
    """(n,) local variance over about so many samples, with a mean of 1."""
    local = gaussian_filter1d(displacement**2, samples, mode="constant")
    mean = float(local.mean())
    return np.asarray(local / mean) if mean > 0 else np.ones_like(local)


def _ends(rate: float) -> int:
    """Number of samples in END_MEAN."""
    return max(1, round(END_MEAN * rate))


def _line_between_the_ends(samples: Vector, rate: float) -> Vector:
    """(n,) straight line through the record's ends."""
    ends = _ends(rate)
    line: Vector = np.linspace(samples[:ends].mean(), samples[-ends:].mean(), samples.size)
    return line


def _power_of_the_line(size: int, rate: float) -> Vector:
    """(size − 2,) periodogram of the error of the line removed from samples of variance 1."""
    return 2 / _ends(rate) * sine_power(falling_line(size))


def _variances_of_the_line(replaced: Vector, displacement_noise: float, rate: float) -> tuple[Vector, Vector]:
    """(n,) m² and (n,) (m/s)², remaining variance from the errors of both ends.

    Args:
        replaced: (n − 2,) share of each of its sines that the transducer does not determine.
        displacement_noise: m.
        rate: Hz.
    """
    start = np.linspace(1.0, 0.0, replaced.size + 2)
    left = sum_with_line(falling_line(start.size) * (replaced - 1), start, rate)
    one, two = (displacement_noise**2 / _ends(rate) * history**2 for history in left)
    return one + one[::-1], two + two[::-1]
