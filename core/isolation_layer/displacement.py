"""How does the layer move, by a displacement transducer: with accelerometers beside it, or alone?"""

import numpy as np

from core.arrays import Vector
from core.errors import RecordError
from core.isolation_layer import sine_series
from core.isolation_layer.equivalent import regression
from core.isolation_layer.motion import MeasuredMotion, ResidualDisplacement
from core.signals.clear_band import clear_band, smoothed
from core.signals.flicker import flicker

START, END = 2.0, 10.0
"""s, of the record's beginning and end whose means the residual displacement is between."""
SHARE = (0.02, 0.1)
"""Of the record: no more of it is beginning or end."""


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

    At each frequency the two are averaged with the inverse of their noise as weights,
    X = (X_d/σ_d² − ω² A/σ_a²) / (1/σ_d² + ω⁴/σ_a²): the transducer rules below ω = √(σ_a/σ_d), the accelerometers
    above. What lasts (a residual offset, a slow drift of the layer) is therefore the transducer's, untouched. The
    variance left at each frequency is 1 / (1/σ_d² + ω⁴/σ_a²); towards the record's ends that of the line between
    them is added.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.
        displacement_noise: m, standard deviation of the transducer's white noise.
        acceleration_noise: m/s², the same of the relative acceleration.
        corner: Hz, at which the flicker noise of the relative acceleration is as strong as its white noise.

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
    ω = sine_series.angular_frequencies(displacement.size, rate)
    trust = np.zeros_like(ω)
    if acceleration_noise > 0:
        rising = flicker(ω / (2 * np.pi), corner)
        trust = ω**4 * (displacement_noise / acceleration_noise) ** 2 / rising
    X_d = sine_series.coefficients(displacement - line)
    X_a = -sine_series.coefficients(relative_acceleration - relative_acceleration.mean()) / ω**2
    fused = sine_series.motion((X_d + trust * X_a) / (1 + trust), line, rate)
    variances = sine_series.variances(displacement_noise**2 / (1 + trust), ω)
    ends = _variances_of_the_line(trust / (1 + trust), displacement_noise, rate)
    std, velocity_std = (np.sqrt(one + end) for one, end in zip(variances, ends, strict=True))
    residual = residual_displacement(displacement, rate)
    noise = displacement_noise * float(np.sqrt(np.mean(1 / (1 + trust))))
    return MeasuredMotion(fused.displacement, fused.velocity, std, velocity_std, (0.0, rate / 2), noise, residual)


def differentiate(displacement: Vector, rate: float, *, displacement_noise: float) -> MeasuredMotion | None:
    """Displacement and velocity from a transducer alone, up to where it stands clear of its noise.

    Above that frequency the history is damped as by a Butterworth filter of order 4 (zero phase). The standard
    deviation is that of the noise which passes the filter, and of the motion which does not: its acceleration is
    taken to be there as strong as in the octave below.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        rate: Hz.
        displacement_noise: m, standard deviation of the transducer's white noise.

    Returns:
        None if the displacement nowhere stands clear of its noise.

    Raises:
        RecordError: the history holds NaN.
    """
    if not np.isfinite(displacement).all():
        raise RecordError("the displacement holds NaN: mend or cut the gaps first")
    line = _line_between_the_ends(displacement, rate)
    ω = sine_series.angular_frequencies(displacement.size, rate)
    sines = sine_series.coefficients(displacement - line)
    frequency = ω / (2 * np.pi)
    power = smoothed(sine_series.power(sines), frequency)
    noise = displacement_noise**2 * (1 + smoothed(_power_of_the_line(displacement.size, rate), frequency))
    band = clear_band(power, noise, frequency)
    if band is None:
        return None
    corner = band[1]
    low_pass = 1 / (1 + (frequency / corner) ** 8)
    smooth = sine_series.motion(sines * low_pass, line, rate)
    signal = np.maximum(power - noise, 0.0)
    octave = (frequency > corner / 2) & (frequency <= corner)
    beyond = np.where(frequency > corner, np.mean((signal * ω**4)[octave]) / ω**4, signal)
    density = displacement_noise**2 * low_pass**2 + beyond * (1 - low_pass) ** 2
    ends = _variances_of_the_line(1 - low_pass, displacement_noise, rate)
    std, velocity_std = (np.sqrt(one + end) for one, end in zip(sine_series.variances(density, ω), ends, strict=True))
    residual = residual_displacement(displacement, rate)
    passed = displacement_noise * float(np.sqrt(np.mean(low_pass**2)))
    return MeasuredMotion(smooth.displacement, smooth.velocity, std, velocity_std, (0.0, corner), passed, residual)


def residual_displacement(displacement: Vector, rate: float) -> ResidualDisplacement:
    """Mean of the record's end less mean of its start, of a transducer's (n,) m at a rate in Hz.

    The standard deviation counts what still moves there as a sample of an autocorrelated process
    (`core.isolation_layer.equivalent.regression`), so that a record which is cut in motion says little of the layer's
    rest.
    """
    first, last = (
        max(2, round(min(length * rate, share * displacement.size)))
        for length, share in zip((START, END), SHARE, strict=True)
    )
    means = [_mean(part) for part in (displacement[:first], displacement[-last:])]
    return ResidualDisplacement(means[1][0] - means[0][0], float(np.hypot(means[0][1], means[1][1])))


def _mean(samples: Vector) -> tuple[float, float]:
    """Mean of an autocorrelated history, and its standard deviation."""
    solution, covariance = regression(np.ones((samples.size, 1)), samples)
    return float(solution[0]), float(np.sqrt(covariance[0, 0]))


def _ends(rate: float) -> int:
    """Samples in half a tenth of a second, whose mean is a record's end."""
    return max(1, round(0.05 * rate))


def _line_between_the_ends(samples: Vector, rate: float) -> Vector:
    """(n,) straight line through the record's ends."""
    ends = _ends(rate)
    line: Vector = np.linspace(samples[:ends].mean(), samples[-ends:].mean(), samples.size)
    return line


def _power_of_the_line(size: int, rate: float) -> Vector:
    """(size − 2,) periodogram of the line's error where the samples' has variance 1: it is taken out of them."""
    return 2 / _ends(rate) * sine_series.power(sine_series.of_falling_line(size))


def _variances_of_the_line(replaced: Vector, displacement_noise: float, rate: float) -> tuple[Vector, Vector]:
    """(n,) m² and (n,) (m/s)², of what is left of the two ends' errors.

    Args:
        replaced: (n − 2,) share of each of its sines that is not kept as the transducer has it.
        displacement_noise: m.
        rate: Hz.
    """
    start = np.linspace(1.0, 0.0, replaced.size + 2)
    left = sine_series.motion(sine_series.of_falling_line(start.size) * (replaced - 1), start, rate)
    variance = displacement_noise**2 / _ends(rate)
    one, two = (variance * history**2 for history in (left.displacement, left.velocity))
    return one + one[::-1], two + two[::-1]
