"""How does the layer move, by accelerometers alone?"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from core.arrays import Vector
from core.errors import RecordError
from core.isolation_layer import sine_series
from core.isolation_layer.motion import MeasuredMotion
from core.signals.clear_band import clear_band, drifting_noise, smoothed
from core.signals.flicker import flicker


def integrate(
    relative_acceleration: Vector, rate: float, *, acceleration_noise: float, noise_corner: float = 0.0
) -> MeasuredMotion | None:
    """Displacement and velocity by double integration of the relative acceleration, where it is clear of its noise.

    The integral is damped below the lowest clear frequency (`core.signals.clear_band`) as by a Butterworth filter of
    order 4 (zero phase): a residual offset and whatever is slower than that are lost. The standard deviation is that of
    the noise, white and drifting, that passes the filter, and of the motion that does not: its spectrum is taken to
    stay below the corner as high as it is in the octave above, as far as the record holds so much there, and its
    variance to rise and fall with the motion.

    Args:
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
        acceleration_noise: m/s², standard deviation of the relative acceleration's white noise.
        noise_corner: Hz, at which its flicker noise is as strong; it counts in the standard deviation alone.

    Returns:
        None if the acceleration nowhere stands clear of its noise.

    Raises:
        RecordError: the history holds NaN.
    """
    if not np.isfinite(relative_acceleration).all():
        raise RecordError("the acceleration holds NaN: mend or cut the gaps first")
    ω = sine_series.angular_frequencies(relative_acceleration.size, rate)
    sines = sine_series.coefficients(relative_acceleration - relative_acceleration.mean())
    periodogram, frequency = sine_series.power(sines), ω / (2 * np.pi)
    noise = drifting_noise(periodogram, frequency, acceleration_noise)
    power = smoothed(periodogram, frequency)
    band = clear_band(power, noise, frequency)
    if band is None:
        return None
    corner = band[0]
    high_pass = 1 / (1 + (corner / frequency) ** 8)
    moved = sine_series.motion(-sines / ω**2 * high_pass, np.zeros_like(relative_acceleration), rate)
    damping = (high_pass / ω**2) ** 2
    left, rising = noise * damping, acceleration_noise**2 * (flicker(frequency, noise_corner) - 1) * damping
    passed = sine_series.variances(left + rising, ω)
    signal = np.maximum(power - noise, 0.0) / ω**4
    level = np.mean(signal[(frequency >= corner) & (frequency < 2 * corner)])
    slow = np.where(frequency < corner, np.minimum(level, power / ω**4), signal)
    lost = sine_series.variances((1 - high_pass) ** 2 * slow, ω)
    envelope = _envelope(moved.displacement, rate / corner)
    std, velocity_std = (np.sqrt(one + other * envelope) for one, other in zip(passed, lost, strict=True))
    return MeasuredMotion(
        moved.displacement, moved.velocity, std, velocity_std, (corner, rate / 2), float(np.sqrt(left.mean()))
    )


def _envelope(displacement: Vector, samples: float) -> Vector:
    """(n,) local variance over about so many samples, its mean 1."""
    local = gaussian_filter1d(displacement**2, samples, mode="constant")
    mean = float(local.mean())
    return np.asarray(local / mean) if mean > 0 else np.ones_like(local)
