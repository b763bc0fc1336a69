"""By which gains, delays and clock rates do the sensors at the layer disagree?

Without any model the layer's displacement x is bound to the accelerations of its sides, x'' = a_base − a_ground. What
is measured of base slab and ground is therefore held against the transducer's: by a gain, a delay and a rate of delay
each. All three have noise, so the squares of what is left are weighed with all of it, and what the noise of base slab
and ground would take from their gains is given back (errors in variables: Deming, 1943; Fuller, 1987, ch. 1-2).

The displacement is differentiated within each window by parts, ∫ φ x'' = ∫ φ'' x with φ = w exp(−iωt): the Hann window
w and its slope vanish at its ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from core.arrays import ComplexMatrix, Matrix, Vector
from core.signals.noise import noise_density

BANDS = ((0.3, 1.5), (0.3, 6.0))
"""Hz, in turn: a delay of 50 ms is first found where its phase is small."""
WINDOW = 20.0
"""s, half of which each window has in common with the next."""
ROUNDS = 8
"""Of Gauss and Newton's iteration in each band."""
OCTAVE = 0.5
"""Octaves, over which what is left is averaged to tell its level."""
FEWEST_LINES = 40
"""Of the spectra, for six unknowns."""
SETTLED = 0.02
"""Standard deviations, of a step that is the last."""
CORRELATED = (1 + 2 * (4 / 9 + 1 / 36)) * (1 + 2 / 36)
"""By how much the lines of Hann windows, and windows that have half in common, know less than as many free of each
other: squares of the correlations 2/3 and 1/6 of neighbouring lines and 1/6 of windows (Harris, 1978)."""
LARGEST_STEP = np.array([0.5, 0.05, 1e-3] * 2)
"""Of each unknown in a round."""
PRIOR = np.array([0.02, 5e-3, 1e-4])
"""Standard deviations of sound sensors' gain, delay in s, and rate of delay."""


@dataclass(frozen=True, slots=True, eq=False)
class LayerAgreement:
    """Of base slab, then ground, against the displacement transducer: logarithm of gain, delay, rate of delay."""

    value: Vector
    """(6,) 1, s and s/s, twice; the delay is that at the record's middle."""
    covariance: Matrix
    """(6, 6)."""


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Spectra of all windows, one after the other."""

    columns: ComplexMatrix
    """(8, lines): x'', base slab, its slope, that times t, ground, its slope, that times t, and ω."""
    noise: Matrix
    """(3, lines) power that noise alone has in x'', base slab and ground."""


def layer_agreement(displacement: Vector, base: Vector, ground: Vector, rate: float) -> LayerAgreement | None:
    """How far the three sensors of a layer agree in one event.

    Args:
        displacement: (n,) m.
        base: (n,) m/s², acceleration above the layer.
        ground: (n,) m/s², below it.
        rate: Hz.

    Returns:
        None where the record is too short, the layer hardly moves, or noise is all that base slab and ground tell.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    density = noise_density(np.array([displacement, base, ground]), rate) * rate / 2
    time = _time(displacement.size, rate)
    sides = [CubicSpline(time, own) for own in (base, ground)]
    found = np.zeros(6)
    for band in BANDS:
        for _ in range(ROUNDS):
            lines = _lines(displacement, sides, found, density, rate, band)
            if lines.columns.shape[1] < FEWEST_LINES:
                return None
            taken = _step(lines, found)
            if taken is None:
                return None
            step, covariance = taken
            found = found + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
            if (np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))).all():
                break
    return LayerAgreement(found, covariance)


def agreeing(displacement: Vector, base: Vector, ground: Vector, rate: float) -> tuple[Vector, Vector]:
    """The accelerations as sensors that agree with the transducer would have recorded them.

    Where the two are fused, a gain of one percent would else make a step in the displacement where the one takes over
    from the other, and a model that is driven by it a force that the layer did not have. Of what the record tells as
    much is believed as it outweighs PRIOR (the posterior mean of normal errors).

    Args: as of `layer_agreement`.

    Returns:
        (n,) m/s² each; as they came where the record is too short, or tells nothing.
    """
    if displacement.size < WINDOW * rate or (found := layer_agreement(displacement, base, ground, rate)) is None:
        return base, ground
    prior = np.diag(np.tile(PRIOR, 2) ** 2)
    believed = prior @ np.linalg.solve(prior + found.covariance, found.value)
    time = _time(base.size, rate)
    mended = [
        np.exp(-gain) * CubicSpline(time, own)(np.clip(time + delay + slow * time, time[0], time[-1]))
        for own, (gain, delay, slow) in zip((base, ground), believed.reshape(2, 3), strict=True)
    ]
    return mended[0], mended[1]


def _lines(
    displacement: Vector,
    sides: Sequence[CubicSpline],
    found: Vector,
    density: Vector,
    rate: float,
    band: tuple[float, float],
) -> _Lines:
    """Spectra of the displacement and of both sides' accelerations, with the delays that were found taken out."""
    count = displacement.size
    time = _time(count, rate)
    rows = [displacement]
    for spline, (_, delay, slow) in zip(sides, found.reshape(2, 3), strict=True):
        at = np.clip(time + delay + slow * time, time[0], time[-1])
        rows += [spline(at), spline(at, 1), time * spline(at, 1)]
    length = min(count, round(WINDOW * rate))
    frequency: Vector = np.asarray(np.fft.rfftfreq(length, 1 / rate), dtype=float)
    within = (frequency >= band[0]) & (frequency <= band[1])
    ω: Vector = np.asarray(2 * np.pi * frequency[within])
    window, twice = _test_function(length, rate, ω)
    spectra = []
    for start in range(0, count - length + 1, length // 2):
        piece = np.array(rows)[:, start : start + length]
        pieces = np.fft.rfft(np.vstack([window * piece[0], piece[1:] * window[0]]), axis=1)[:, within]
        spectra.append(np.vstack([np.sum(twice * pieces[:3], axis=0), pieces[3:], ω]))
    noise = density[:, None] * np.array([_power(window, ω), *[np.full(ω.size, np.sum(window[0] ** 2))] * 2])
    return _Lines(np.hstack(spectra), np.tile(noise, len(spectra)))


def _time(count: int, rate: float) -> Vector:
    """s, from the record's middle."""
    return np.asarray((np.arange(count) - (count - 1) / 2) / rate)


def _test_function(length: int, rate: float, ω: Vector) -> tuple[Matrix, ComplexMatrix]:
    """(3, length) w, w' and w'', and (3, frequencies) their weights in φ'' / exp(−iωt)."""
    phase = 2 * np.pi * np.arange(length) / length
    turn = 2 * np.pi * rate / length
    window = np.array([(1 - np.cos(phase)) / 2, turn * np.sin(phase) / 2, turn**2 * np.cos(phase) / 2])
    return window, np.array([-(ω**2), -2j * ω, np.ones_like(ω)])


def _power(window: Matrix, ω: Vector) -> Vector:
    """(frequencies,) that φ'' gives white noise of variance 1."""
    w, slope, bend = window
    return np.asarray([np.sum((bend - o**2 * w) ** 2 + (2 * o * slope) ** 2) for o in ω])


def _step(lines: _Lines, found: Vector) -> tuple[Vector, Matrix] | None:
    """Gauss and Newton's step, and the covariance of what it leads to; None where nothing but noise is left."""
    layer, base, ground = lines.columns[0], lines.columns[1:4], lines.columns[4:7]
    shares = np.exp(-found[[0, 3]])
    residual = layer - shares[0] * base[0] + shares[1] * ground[0]
    jacobian = np.vstack([shares[0] * base * [[1], [-1], [-1]], -shares[1] * ground * [[1], [-1], [-1]]])
    noise = lines.noise * np.array([1.0, *shares**2])[:, None]
    level = _level(np.abs(residual) ** 2 / noise.sum(axis=0), lines.columns[-1].real)
    weight = 1 / (level * noise.sum(axis=0))
    normal = (jacobian * weight @ jacobian.conj().T).real
    descent = (jacobian.conj() * weight @ residual).real
    taken = np.sum(noise[1:] * level * weight, axis=1)  # by the noise of base slab and ground from their gains
    descent[[0, 3]] += taken
    normal[[0, 3], [0, 3]] -= taken
    if not (np.diag(normal) > 0).all():
        return None
    scale = 1 / np.sqrt(np.diag(normal))
    inverse = np.linalg.pinv(normal * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
    return -inverse @ descent, inverse * CORRELATED / 2


def _level(excess: Vector, ω: Vector) -> Vector:
    """(lines,) what is left over its expectation, averaged over half an octave and all windows; at least 1."""
    bands = np.floor(np.log2(ω / ω.min()) / OCTAVE + 1e-9).astype(int)
    mean = np.bincount(bands, excess) / np.maximum(np.bincount(bands), 1)
    return np.asarray(np.maximum(mean[bands], 1.0))
