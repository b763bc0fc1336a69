"""Equivalent stiffness and damping of the isolation layer, segment by segment (paper, eq 24-27)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d

from core.arrays import Matrix, Vector
from core.isolation_layer.motion import MeasuredMotion, Motion

Span = tuple[int, int]
"""First sample of a segment, and one past its last."""

FEWEST_SAMPLES = 12
"""Of a segment: four for each of the three coefficients."""

NOT_HARMONIC = 0.5
"""Of a cycle's standard deviation: with more than that beside its mean and first harmonic it has no one amplitude.

Half leaves two thirds of a real building's cycles; a quarter leaves a third, and only the stiffer ones of those.
"""
UNDETERMINED = 0.2
"""Of k_eq: a segment of larger standard deviation says nothing about it."""
SMOOTH_SHARE = 1 / 32
"""Of a segment, over which its residual is averaged to tell what the model misses from noise."""


@dataclass(frozen=True, slots=True)
class EquivalentSegment:
    """The layer as a spring and a dashpot over one segment of the record."""

    start: float
    """s after the record's start."""
    end: float
    """s after the record's start."""
    amplitude: float
    """m, √2 · RMS of the displacement about its mean (eq 27)."""
    shear_strain: float | None
    """amplitude / rubber height; None where the height is not known."""
    k_eq: float
    """N/m."""
    k_eq_std: float
    c_eq: float
    """N s/m."""
    c_eq_std: float


def cycles(displacement: Vector, threshold: float) -> tuple[Span, ...]:
    """Complete cycles between zero up-crossings.

    An up-crossing counts once the displacement has gone from below −threshold/2 to above +threshold/2 (hysteresis:
    noise that crosses zero makes no cycle), and a cycle once its amplitude, √2 · RMS about its mean, reaches the
    threshold. It must be one oscillation: where two frequencies mix, or most of the time is rest, k_eq belongs to no
    one amplitude.

    Args:
        displacement: (n,) m, about its position at rest.
        threshold: m, the smallest amplitude that counts.
    """
    side = np.where(displacement > threshold / 2, 1, np.where(displacement < -threshold / 2, -1, 0))
    beyond = np.flatnonzero(side)
    turn = np.flatnonzero((side[beyond][:-1] < 0) & (side[beyond][1:] > 0))
    crossings = [_up_crossing(displacement, *beyond[i : i + 2]) for i in turn]
    return tuple((a, b) for a, b in pairwise(crossings) if _is_cycle(displacement[a:b], threshold))


def windows(size: int, rate: float, length: float) -> tuple[Span, ...]:
    """The paper's segments: windows of a fixed length in s, one after the other; what is left at the end is dropped."""
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
    """The same, their standard deviations enlarged by the slow motion that an integral of accelerations lacks.

    An error slower than a cycle is nearly a straight line over it. The intercept takes up its mean; its slope, of
    2π f σ for an error of standard deviation σ below the frequency f, looks like a harmonic of amplitude 2 f T σ over a
    cycle of T seconds. Of a motion that a transducer measured nothing is added.

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
    """The same, their standard deviations enlarged by errors of the force that are alike from sample to sample.

    A residual shows none of an error that looks like a spring's or a dashpot's force. So each error is regressed as
    the force is, and the variances added.

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
    """(samples, 3) displacement, velocity and intercept over their (3,) scales, so that metres and metres per second
    weigh alike in the pseudo-inverse; and the scales."""
    x, v = motion.displacement[span], motion.velocity[span]
    scale = np.array([x.std(), v.std(), 1.0])
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
    """Those whose k_eq is known to 20 %, by its standard deviation."""
    return tuple(segment for segment in segments if segment.k_eq_std < UNDETERMINED * segment.k_eq)


def amplitude(displacement: Vector) -> float:
    """√2 · RMS about the mean (eq 27), in m: the amplitude of a sine."""
    return float(np.sqrt(2.0) * displacement.std())


def regression(regressors: Matrix, response: Vector) -> tuple[Vector, Matrix]:
    """Least squares, and a covariance that holds when the model misses something and when there is noise.

    The residual of a hysteretic layer is smooth: it is what a spring and a dashpot miss. White noise on top of it
    would hide its autocorrelation, so that the two are told apart by a running mean and their covariances added.

    Args:
        regressors: (n, p).
        response: (n,).

    Returns:
        (p,) coefficients and (p, p) covariance.
    """
    count, coefficients = regressors.shape
    solution = np.asarray(np.linalg.lstsq(regressors, response, rcond=None)[0])
    residual = response - regressors @ solution
    smooth = uniform_filter1d(residual, max(1, round(SMOOTH_SHARE * count)), mode="nearest")
    meat = _long_run(regressors * smooth[:, None]) + _long_run(regressors * (residual - smooth)[:, None])
    bread = np.linalg.pinv(regressors.T @ regressors)
    covariance: Matrix = bread @ meat @ bread * count / (count - coefficients)
    return solution, covariance


def _long_run(score: Matrix) -> Matrix:
    """(p, p) covariance of the sum of an autocorrelated (n, p) score.

    Newey and West (1987) with the Bartlett kernel, prewhitened by a first-order process for each coefficient
    (Andrews and Monahan, 1992).
    """
    ρ = np.clip(
        np.sum(score[1:] * score[:-1], axis=0) / np.maximum(np.sum(score**2, axis=0), np.finfo(float).tiny), 0, 0.97
    )
    white = score[1:] - ρ * score[:-1]
    bandwidth = _bandwidth(white)
    meat = white.T @ white
    for lag in range(1, bandwidth + 1):
        product = white[lag:].T @ white[:-lag]
        meat += (1 - lag / (bandwidth + 1)) * (product + product.T)
    return np.asarray(meat / np.outer(1 - ρ, 1 - ρ))


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


def _bandwidth(score: Matrix) -> int:
    """Newey and West (1994): lags for a Bartlett kernel."""
    return int(4 * (score.shape[0] / 100) ** (2 / 9))


def _is_cycle(displacement: Vector, threshold: float) -> bool:
    """Whether this is one oscillation of sufficient amplitude: mean and first harmonic explain nearly all of it."""
    if displacement.size < FEWEST_SAMPLES or amplitude(displacement) < threshold:
        return False
    centred = displacement - displacement.mean()
    turn = np.exp(2j * np.pi * np.arange(centred.size) / centred.size)
    beside = 1 - 2 * abs(np.vdot(turn, centred)) ** 2 / (centred.size * np.vdot(centred, centred))
    return bool(beside < NOT_HARMONIC**2)


def _up_crossing(displacement: Vector, below: int, above: int) -> int:
    """The first sample at or above zero after the last one below it, between the two given samples."""
    return int(below + 1 + np.flatnonzero(displacement[below : above + 1] < 0)[-1])
