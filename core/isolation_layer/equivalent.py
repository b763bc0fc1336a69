"""Equivalent stiffness and damping of the isolation layer, segment by segment (paper, eq 24-27)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from core.arrays import Matrix, Vector
from core.isolation_layer.motion import MeasuredMotion, Motion
from core.signals.regression import regression

Span = tuple[int, int]
"""First sample of a segment, and one past its last."""

FEWEST_SAMPLES = 12
"""Samples of a segment at least: four for each of the three coefficients."""
NOT_HARMONIC = 0.5
"""Standard deviation beside mean and first harmonic, over that of the cycle, above which it has no single amplitude.

Measured on a real building: one half keeps two thirds of the cycles, one quarter only a third, and of
those the stiffer ones."""
UNDETERMINED = 0.2
"""Relative standard deviation of k_eq above which a segment is dropped. Not tuned."""


@dataclass(frozen=True, slots=True)
class EquivalentSegment:
    """Spring and dashpot equivalent to the layer over one segment of the record."""

    start: float
    """s after the record's start."""
    end: float
    """s after the record's start."""
    amplitude: float
    """m, √2 · RMS of the displacement about its mean (eq 27)."""
    shear_strain: float | None
    """amplitude / rubber height; None if the height is unknown."""
    k_eq: float
    """N/m."""
    k_eq_std: float
    c_eq: float
    """N s/m."""
    c_eq_std: float


def cycles(displacement: Vector, threshold: float) -> tuple[Span, ...]:
    """Complete cycles between zero up-crossings.

    An up-crossing counts once the displacement has risen from below −threshold/2 to above +threshold/2, so that noise
    around zero makes no cycle. A cycle counts if its amplitude, √2 · RMS about its mean, reaches the threshold and if
    it is one oscillation: where two frequencies mix, or the layer mostly rests, k_eq belongs to no single amplitude.

    Args:
        displacement: (n,) m, relative to its position at rest.
        threshold: m, the smallest amplitude that counts.
    """
    side = np.where(displacement > threshold / 2, 1, np.where(displacement < -threshold / 2, -1, 0))
    beyond = np.flatnonzero(side)
    turn = np.flatnonzero((side[beyond][:-1] < 0) & (side[beyond][1:] > 0))
    crossings = [_up_crossing(displacement, *beyond[i : i + 2]) for i in turn]
    return tuple((a, b) for a, b in pairwise(crossings) if _is_cycle(displacement[a:b], threshold))


def windows(size: int, rate: float, length: float) -> tuple[Span, ...]:
    """The paper's segments: successive windows of a fixed length in s; the remainder at the end is dropped."""
    step = max(FEWEST_SAMPLES, round(length * rate))
    return tuple((start, start + step) for start in range(0, size - step + 1, step))


def equivalent_segments(
    force: Vector, motion: Motion, rate: float, spans: Sequence[Span], rubber_height: float | None = None
) -> tuple[EquivalentSegment, ...]:
    """k_eq and c_eq of each span by least squares with an intercept (eq 24-26).

    Args:
        force: (n,) N, restoring force.
        motion: of the isolation layer, n samples.
        rate: Hz.
        spans: the segments, as from `cycles` or `windows`.
        rubber_height: m, displacement of 100 % shear strain.
    """
    return tuple(_segment(force, motion, rate, span, rubber_height) for span in spans)


def with_slow_errors(
    segments: Sequence[EquivalentSegment], motion: MeasuredMotion, rate: float
) -> tuple[EquivalentSegment, ...]:
    """Segments whose standard deviations include the slow motion that an integral of accelerations misses.

    An error slower than a cycle is nearly a straight line over it. The intercept takes up its mean; its slope, of
    2π f σ for an error of standard deviation σ below the frequency f, looks like a harmonic of amplitude 2 f T σ over a
    cycle of T seconds. A motion measured by a transducer adds nothing.

    Args:
        segments: of the motion.
        motion: of the isolation layer.
        rate: Hz.
    """
    if not motion.is_integrated:
        return tuple(segments)
    return tuple(_with_slow_error(segment, motion, rate) for segment in segments)


def with_force_errors(
    segments: Sequence[EquivalentSegment], errors: Matrix, motion: Motion, rate: float
) -> tuple[EquivalentSegment, ...]:
    """Segments whose standard deviations include systematic errors of the force.

    A residual does not show an error that resembles a spring's or a dashpot's force. Each error is therefore regressed
    as the force is, and the variances are added.

    Args:
        segments: of the motion and of the force.
        errors: (p, n) N, effect of one standard deviation of each of p independent causes on the force.
        motion: of the isolation layer.
        rate: Hz.
    """
    return tuple(_with_force_error(segment, errors, motion, rate) for segment in segments)


def _with_force_error(segment: EquivalentSegment, errors: Matrix, motion: Motion, rate: float) -> EquivalentSegment:
    span = slice(round(segment.start * rate), round(segment.end * rate))
    regressors, scale = _regressors(motion, span)
    k, c, _ = np.linalg.lstsq(regressors, errors[:, span].T, rcond=None)[0] / scale[:, None]
    return replace(
        segment,
        k_eq_std=float(np.hypot(segment.k_eq_std, np.linalg.norm(k))),
        c_eq_std=float(np.hypot(segment.c_eq_std, np.linalg.norm(c))),
    )


def _regressors(motion: Motion, span: slice) -> tuple[Matrix, Vector]:
    """(samples, 3) displacement, velocity and intercept over their scales, and the (3,) scales.

    Scaled, metres and metres per second weigh alike in the pseudo-inverse.
    """
    x, v = motion.displacement[span], motion.velocity[span]
    scale = np.array([_deviation(x), _deviation(v), 1.0])
    return np.column_stack([x, v, np.ones_like(x)]) / scale, scale


def _with_slow_error(segment: EquivalentSegment, motion: MeasuredMotion, rate: float) -> EquivalentSegment:
    span = slice(round(segment.start * rate), round(segment.end * rate))
    length = segment.end - segment.start
    error = float(np.sqrt(np.mean(motion.displacement_std[span] ** 2))) * min(1.0, 2 * motion.band[0] * length)
    k_error = abs(segment.k_eq) * error / segment.amplitude
    return replace(
        segment,
        k_eq_std=float(np.hypot(segment.k_eq_std, k_error)),
        c_eq_std=float(np.hypot(segment.c_eq_std, k_error * length / (2 * np.pi))),
    )


def determined(segments: Sequence[EquivalentSegment]) -> tuple[EquivalentSegment, ...]:
    """Segments whose k_eq has a standard deviation below 20 %."""
    return tuple(segment for segment in segments if segment.k_eq_std < UNDETERMINED * segment.k_eq)


def amplitude(displacement: Vector) -> float:
    """Amplitude √2 · RMS about the mean (eq 27), m: that of a sine."""
    return float(np.sqrt(2.0)) * _deviation(displacement)


def _deviation(samples: Vector) -> float:
    """Standard deviation; of the few hundred samples of a cycle several times as fast as by numpy's own."""
    centred = samples - samples.sum() / samples.size
    return float(np.sqrt(centred @ centred / samples.size))


def _segment(force: Vector, motion: Motion, rate: float, span: Span, rubber_height: float | None) -> EquivalentSegment:
    start, end = span
    regressors, scale = _regressors(motion, slice(start, end))
    coefficients, covariance = regression(regressors, force[start:end])
    k_eq, c_eq, _ = coefficients / scale
    k_eq_std, c_eq_std, _ = np.sqrt(np.diag(covariance)) / scale
    reached = amplitude(motion.displacement[start:end])
    return EquivalentSegment(
        start=start / rate,
        end=end / rate,
        amplitude=reached,
        shear_strain=None if rubber_height is None else reached / rubber_height,
        k_eq=float(k_eq),
        k_eq_std=float(k_eq_std),
        c_eq=float(c_eq),
        c_eq_std=float(c_eq_std),
    )


def _is_cycle(displacement: Vector, threshold: float) -> bool:
    """True if this is one oscillation of sufficient amplitude, which mean and first harmonic nearly explain."""
    if displacement.size < FEWEST_SAMPLES or amplitude(displacement) < threshold:
        return False
    centred = displacement - displacement.mean()
    turn = np.exp(2j * np.pi * np.arange(centred.size) / centred.size)
    beside = 1 - 2 * abs(np.vdot(turn, centred)) ** 2 / (centred.size * np.vdot(centred, centred))
    return bool(beside < NOT_HARMONIC**2)


def _up_crossing(displacement: Vector, below: int, above: int) -> int:
    """First sample at or above zero after the last one below it, between the two given samples."""
    return int(below + 1 + np.flatnonzero(displacement[below : above + 1] < 0)[-1])
