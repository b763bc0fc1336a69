"""How the isolation layer moved: displacement and velocity from every sensor that saw it.

Both ways work on the odd (sine) extension of the record after the line from its first to its last value is
taken out: that extension has no jump, in value or in slope, so that a record which does not begin and end at rest
can be differentiated and integrated by its spectrum without ringing at the ends.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, dst, idst

from core.arrays import Vector
from core.errors import RecordError


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion of the isolation layer: of the base slab relative to the ground."""

    displacement: Vector
    """(n,) m."""
    velocity: Vector
    """(n,) m/s."""
    noise: float = 0.0
    """m, standard deviation of the displacement's noise."""


def fuse(
    displacement: Vector,
    relative_acceleration: Vector,
    rate: float,
    *,
    displacement_noise: float,
    acceleration_noise: float,
) -> Motion:
    """Displacement and velocity by Wiener fusion of a displacement and an acceleration record.

    At each frequency the two are averaged with the inverse of their noise as weights,
    X = (X_d/σ_d² − ω² A/σ_a²) / (1/σ_d² + ω⁴/σ_a²): the transducer rules below ω = √(σ_a/σ_d), the accelerometers
    above. What lasts (a residual offset, a slow drift of the layer) is therefore the transducer's, untouched.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
        displacement_noise: m, standard deviation of the transducer's white noise.
        acceleration_noise: m/s², the same of the relative acceleration.

    Raises:
        RecordError: the two histories differ in length, or hold NaN.
    """
    if displacement.shape != relative_acceleration.shape:
        raise RecordError(
            f"displacement has {displacement.size} samples, acceleration {relative_acceleration.size}: "
            "put both on one time base"
        )
    if not (np.isfinite(displacement).all() and np.isfinite(relative_acceleration).all()):
        raise RecordError("displacement or acceleration holds NaN: mend or cut the gaps first")
    line = _line_between_the_ends(displacement, rate)
    ω = _sine_frequencies(displacement.size, rate)
    trust = ω**4 * (displacement_noise / acceleration_noise) ** 2 if acceleration_noise > 0 else np.zeros_like(ω)
    X_d = dst((displacement - line)[1:-1], type=1)
    X_a = -dst((relative_acceleration - relative_acceleration.mean())[1:-1], type=1) / ω**2
    noise = displacement_noise * float(np.sqrt(np.mean(1 / (1 + trust))))
    return _motion((X_d + trust * X_a) / (1 + trust), line, rate, noise)


def integrate(relative_acceleration: Vector, rate: float, lowest: float, *, acceleration_noise: float) -> Motion:
    """Displacement and velocity by double integration of the relative acceleration.

    The integral is damped below `lowest` as by a Butterworth filter of order 4 (zero phase), because the noise of
    accelerometers grows as 1/ω² in it: a residual offset and whatever is slower than that are lost.

    Args:
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
        lowest: Hz, corner of the high-pass.
        acceleration_noise: m/s², standard deviation of the relative acceleration's white noise.

    Raises:
        RecordError: the history holds NaN.
    """
    if not np.isfinite(relative_acceleration).all():
        raise RecordError("the acceleration holds NaN: mend or cut the gaps first")
    ω = _sine_frequencies(relative_acceleration.size, rate)
    A = dst((relative_acceleration - relative_acceleration.mean())[1:-1], type=1)
    high_pass = 1 / (1 + (2 * np.pi * lowest / ω) ** 8)
    noise = acceleration_noise * float(np.sqrt(np.mean((high_pass / ω**2) ** 2)))
    return _motion(-A / ω**2 * high_pass, np.zeros_like(relative_acceleration), rate, noise)


def _sine_frequencies(size: int, rate: float) -> Vector:
    """(size − 2,) rad/s, of the sine series that vanishes at the first and the last sample."""
    frequencies: Vector = np.pi * np.arange(1, size - 1) * rate / (size - 1)
    return frequencies


def _line_between_the_ends(samples: Vector, rate: float) -> Vector:
    """(n,) straight line through the record's ends, each the mean of the first or last tenth of a second."""
    ends = max(1, round(0.05 * rate))
    line: Vector = np.linspace(samples[:ends].mean(), samples[-ends:].mean(), samples.size)
    return line


def _motion(sines: Vector, line: Vector, rate: float, noise: float) -> Motion:
    """Sum of the sine series and of the line, and its exact derivative."""
    ω = _sine_frequencies(line.size, rate)
    slope = (line[-1] - line[0]) * rate / (line.size - 1)
    displacement = line.copy()
    displacement[1:-1] += idst(sines, type=1)
    cosines = np.concatenate([[0.0], sines * ω, [0.0]])
    velocity: Vector = dct(cosines, type=1) / (2 * (line.size - 1)) + slope
    return Motion(displacement=displacement, velocity=velocity, noise=noise)
