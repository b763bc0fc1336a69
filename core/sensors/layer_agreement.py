"""The three sensors of a layer compared: gains, delays and clock rates, and displacement channels that are integrals.

The layer's displacement x determines the difference of the accelerations of its sides, x'' = a_base − a_ground, without
any model. The accelerations of base slab and ground are therefore compared with the transducer's displacement, with a
gain, a delay and a rate of delay each. All three have noise: the residuals are weighted with all of it, and the bias
that the noise of base slab and ground causes in their gains is removed (errors in variables: Deming, 1943; Fuller,
1987, chapters 1-2). The displacement is differentiated within each window by parts, ∫ φ x'' = ∫ φ'' x with
φ = w exp(−iωt): the Hann window w and its slope vanish at its ends.

Some acquisition systems record the accelerations integrated twice as a channel of displacement, which is independent of
nothing. It follows them far above the frequency where a transducer's noise would hide the motion, and its filter has
removed slow motion that the accelerations contain. A transducer does neither; an integral does both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from core.arrays import ComplexMatrix, Matrix, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.optimisation import scaled_inverse
from core.record import Direction, Record
from core.signals.noise import noise_density, noise_std
from core.signals.spectra import HANN_CORRELATION, hann_spectra

BANDS = ((0.3, 1.5), (0.3, 6.0))
"""Hz, in turn: a delay of 50 ms is estimated first where its phase is small."""
WINDOW = 20.0
"""s; each window overlaps the next by half. A choice: five periods of the slowest isolation layers."""
ROUNDS = 8
"""Gauss-Newton iterations in each band at most. Not tuned."""
OCTAVE = 0.5
"""Octaves over which squared residuals are averaged. Not tuned."""
FEWEST_LINES = 40
"""Fewest lines of the spectra, for six unknowns. Not tuned."""
SETTLED = 0.02
"""Standard deviations, largest step of the last iteration. Not tuned."""
CORRELATED = HANN_CORRELATION * (1 + 2 / 36)
"""Factor by which the lines of half-overlapping Hann windows hold less information than independent ones: windows have
a correlation of 1/6 (Harris, 1978)."""
LARGEST_STEP = np.array([0.5, 0.05, 1e-3] * 2)
"""Largest change of each unknown in an iteration. Not tuned."""
PRIOR = np.array([0.02, 5e-3, 1e-4])
"""Standard deviations of the gain (1), delay (s) and rate of delay (s/s) of sound sensors. Not tuned."""
FOLLOWED = 12.0
"""Hz; no transducer in use has less noise than the accelerometers' integral up to this frequency."""
SLOW = (0.05, 0.5)
"""Hz, range in which an integral's filter begins to remove motion."""
STARTS = 9
"""Bands that begin in SLOW, evenly spaced in the logarithm. Not tuned."""
FEWEST_BAND_LINES = 4
"""Fewest lines of the spectrum in a band; a quarter of an octave if that is more. Not tuned."""
FILTERED = 0.8
"""Share of a slow motion below which a channel has been filtered. Not tuned."""
COHERENT = 0.9
"""Least coherence of two records that contain the same motion. Not tuned."""


@dataclass(frozen=True, slots=True, eq=False)
class LayerAgreement:
    """Differences of base slab, then ground, from the displacement transducer: logarithm of gain, delay, rate of
    delay."""

    value: Vector
    """(6,) 1, s and s/s, twice; the delay is that in the middle of the record."""
    covariance: Matrix
    """(6, 6)."""


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Spectra of all windows in sequence."""

    columns: ComplexMatrix
    """(8, lines): x'', base slab, its slope, that times t, ground, its slope, that times t, and ω."""
    noise: Matrix
    """(3, lines) power of the noise alone in x'', base slab and ground."""


def layer_agreement(displacement: Vector, base: Vector, ground: Vector, rate: float) -> LayerAgreement | None:
    """Differences between the three sensors of a layer in one event.

    Args:
        displacement: (n,) m.
        base: (n,) m/s², acceleration above the layer.
        ground: (n,) m/s², below it.
        rate: Hz.

    Returns:
        None if the record is too short, the layer barely moves, or base slab and ground contain noise alone.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    density = noise_density(np.array([displacement, base, ground]), rate) * rate / 2
    time = _time(displacement.size, rate)
    sides = [scipy.interpolate.CubicSpline(time, own) for own in (base, ground)]
    errors = np.zeros(6)
    for band in BANDS:
        for _ in range(ROUNDS):
            lines = _lines(displacement, sides, errors, density, rate, band)
            if lines.columns.shape[1] < FEWEST_LINES:
                return None
            step, covariance = _step(lines, errors)
            errors = errors + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
            if covariance is not None and (np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))).all():
                break
    return None if covariance is None else LayerAgreement(errors, covariance)


def recorded_agreement(record: Record, description: BuildingDescription, direction: Direction) -> LayerAgreement | None:
    """`layer_agreement` of the channels of one direction; None also where one of them is missing.

    Args:
        record: complete channels relative to their position at rest, one per level, quantity and direction.
        description: of the building.
        direction: horizontal.
    """
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = (record.find(level, "acceleration", direction) for level in (base, ground))
    if displacement is None or above is None or below is None:
        return None
    try:
        return layer_agreement(displacement, above, below, record.rate)
    except RecordError:  # too short to estimate its noise
        return None


def agreeing(
    displacement: Vector, base: Vector, ground: Vector, rate: float, agreement: LayerAgreement | None = None
) -> tuple[Vector, Vector]:
    """The accelerations as recorded by sensors that agree with the transducer.

    In the fusion of the two, an error of the gain by one percent would cause a step in the displacement at the
    crossover frequency, and in a model of the layer a spurious force. The differences are shrunk by PRIOR (posterior
    mean with normal errors).

    Args: as for `layer_agreement`, and its result if it is known.

    Returns:
        (n,) m/s² each; unchanged if the record does not determine the differences.
    """
    if displacement.size < WINDOW * rate:
        return base, ground
    agreement = agreement or layer_agreement(displacement, base, ground, rate)
    if agreement is None:
        return base, ground
    prior = np.diag(np.tile(PRIOR, 2) ** 2)
    posterior = prior @ np.linalg.solve(prior + agreement.covariance, agreement.value)
    time = _time(base.size, rate)
    corrected = [
        np.exp(-gain) * scipy.interpolate.CubicSpline(time, own)(np.clip(time + delay + slow * time, time[0], time[-1]))
        for own, (gain, delay, slow) in zip((base, ground), posterior.reshape(2, 3), strict=True)
    ]
    return corrected[0], corrected[1]


def _lines(
    displacement: Vector,
    sides: Sequence["scipy.interpolate.CubicSpline"],
    errors: Vector,
    density: Vector,
    rate: float,
    band: tuple[float, float],
) -> _Lines:
    """Spectra of the displacement and of both sides' accelerations, with the estimated delays removed."""
    count = displacement.size
    time = _time(count, rate)
    rows = [displacement]
    for spline, (_, delay, slow) in zip(sides, errors.reshape(2, 3), strict=True):
        at = np.clip(time + delay + slow * time, time[0], time[-1])
        slope = spline(at, 1)
        rows += [spline(at), slope, time * slope]
    columns = np.array(rows)
    length = min(count, round(WINDOW * rate))
    frequency: Vector = np.asarray(np.fft.rfftfreq(length, 1 / rate), dtype=float)
    within = (frequency >= band[0]) & (frequency <= band[1])
    ω: Vector = np.asarray(2 * np.pi * frequency[within])
    window, twice = _test_function(length, rate, ω)
    spectra = []
    for start in range(0, count - length + 1, length // 2):
        piece = columns[:, start : start + length]
        pieces = np.fft.rfft(np.vstack([window * piece[0], piece[1:] * window[0]]), axis=1)[:, within]
        spectra.append(np.vstack([np.sum(twice * pieces[:3], axis=0), pieces[3:], ω]))
    noise = density[:, None] * np.array([_power(window, ω), *[np.full(ω.size, np.sum(window[0] ** 2))] * 2])
    return _Lines(np.hstack(spectra), np.tile(noise, len(spectra)))


def _time(count: int, rate: float) -> Vector:
    """(count,) s, from the middle of the record."""
    return np.asarray((np.arange(count) - (count - 1) / 2) / rate)


def _test_function(length: int, rate: float, ω: Vector) -> tuple[Matrix, ComplexMatrix]:
    """(3, length) w, w' and w'', and (3, frequencies) their weights in φ'' / exp(−iωt)."""
    phase = 2 * np.pi * np.arange(length) / length
    turn = 2 * np.pi * rate / length
    window = np.array([(1 - np.cos(phase)) / 2, turn * np.sin(phase) / 2, turn**2 * np.cos(phase) / 2])
    return window, np.array([-(ω**2), -2j * ω, np.ones_like(ω)])


def _power(window: Matrix, ω: Vector) -> Vector:
    """(frequencies,) power of white noise of variance 1 after multiplication by φ''."""
    w, slope, bend = window
    return np.asarray(bend @ bend + (4 * (slope @ slope) - 2 * (bend @ w)) * ω**2 + (w @ w) * ω**4)


def _step(lines: _Lines, errors: Vector) -> tuple[Vector, Matrix | None]:
    """Gauss-Newton step, and the covariance of the result.

    The noise is taken from the size of the residuals. Far from the solution these are errors of gains and delays, and a
    correction for the bias of so much noise would lead away. Where it asks for more than the LARGEST_STEP, the step is
    the one without it, and the covariance is None; it stays None if only noise is left.
    """
    layer, base, ground = lines.columns[0], lines.columns[1:4], lines.columns[4:7]
    shares = np.exp(-errors[[0, 3]])
    residual = layer - shares[0] * base[0] + shares[1] * ground[0]
    jacobian = np.vstack([shares[0] * base * [[1], [-1], [-1]], -shares[1] * ground * [[1], [-1], [-1]]])
    noise = lines.noise * np.array([1.0, *shares**2])[:, None]
    level = _level(np.abs(residual) ** 2 / noise.sum(axis=0), lines.columns[-1].real)
    weight = 1 / (level * noise.sum(axis=0))
    normal = (jacobian * weight @ jacobian.conj().T).real
    descent = (jacobian.conj() * weight @ residual).real
    bias = np.zeros(6)  # of the gains, by the noise of base slab and ground
    bias[[0, 3]] = np.sum(noise[1:] * level * weight, axis=1)
    unbiased = normal - np.diag(bias)
    if _is_positive_definite(unbiased):
        inverse = scaled_inverse(unbiased)
        step = -inverse @ (descent + bias)
        if (np.abs(step) <= LARGEST_STEP).all():
            return step, inverse * CORRELATED / 2
    return -scaled_inverse(normal) @ descent, None


def _is_positive_definite(matrix: Matrix) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True


def _level(excess: Vector, ω: Vector) -> Vector:
    """(lines,) squared residual over its expectation, averaged over half an octave and all windows; at least 1."""
    bands = np.floor(np.log2(ω / ω.min()) / OCTAVE + 1e-9).astype(int)
    mean = np.bincount(bands, excess) / np.maximum(np.bincount(bands), 1)
    return np.asarray(np.maximum(mean[bands], 1.0))


def transducer_reading(record: Record, description: BuildingDescription, direction: Direction) -> Vector | None:
    """(n,) m, displacement of the layer measured by a transducer; None without one.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = (record.find(level, "acceleration", direction) for level in (base, ground))
    if displacement is None or above is None or below is None:
        return displacement
    return None if is_integral(displacement, above - below, record.rate) else displacement


def is_integral(displacement: Vector, relative_acceleration: Vector, rate: float) -> bool:
    """True if a channel of displacement was computed from the accelerations.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    own, other = noise_std(np.array([displacement, relative_acceleration]), rate)
    follows = other > own * (2 * np.pi * FOLLOWED) ** 2
    return bool(follows and _smallest_share(displacement, relative_acceleration, rate) < FILTERED)


def _smallest_share(displacement: Vector, relative: Vector, rate: float) -> float:
    """Least share that the channel has of the slow motion common to both records; 1 if there is none.

    The accelerations' noise does not lower it: the integral is regressed on the channel.
    """
    centred = np.array([row - row.mean() for row in (displacement, relative)])
    spectra = hann_spectra(centred, rate)
    frequency, (moved, bent) = spectra.frequency[1:], spectra.values[:, 1:]
    integral, share = -bent / (2 * np.pi * frequency) ** 2, 1.0
    for start in np.searchsorted(frequency, np.geomspace(*SLOW, STARTS)):
        band = slice(start, max(start + FEWEST_BAND_LINES, int(np.searchsorted(frequency, 2**0.25 * frequency[start]))))
        common = float(np.abs(np.vdot(integral[band], moved[band])))
        own, other = (float(np.linalg.norm(row[band])) for row in (moved, integral))
        if common > COHERENT * own * other > 0:
            share = min(share, own**2 / common)
    return share
