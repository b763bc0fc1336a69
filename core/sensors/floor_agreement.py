"""Gains, delays and clock rates of the floors' sensors relative to the base slab's.

Up to slightly above the first fixed-base frequency a floor moves as the base slab, with the first mode and with the
quasi-static part of higher ones: a = g (a_base + c q'' − γ a_base''), with an oscillator q driven by a_base that all
floors have in common. Where the frequency goes to 0 both vanish: only the gain g and a delay remain.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import scipy

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.optimisation import scaled_inverse
from core.signals.noise import noise_density
from core.signals.spectra import HANN_CORRELATION

LOWEST = 0.15
"""Hz, above the drift of accelerometers. Not tuned."""
HIGHEST = 1.2
"""Highest frequency over the first fixed-base frequency: sufficiently below the second. Not tuned."""
FREQUENCIES = np.geomspace(0.6, 4.0, 28)
"""Hz, first fixed-base frequencies from which the search begins. A choice: steps of 7 %."""
DAMPING = 0.02
"""Damping ratio of the first mode with which the search begins: a choice."""
SAMPLED = 25.0
"""Hz, rate at which the mode's motion is computed: the lines end at 4.8 Hz, and motion beyond half this rate leaks into
them, through the window, by less than 1e-8."""
BEGINNING = 2.0
"""s, in which a record that begins at rest shows little motion. Not tuned."""
AT_REST = 0.1
"""Standard deviation of the beginning over that of the channel, beside its noise, below which it is at rest. Not tuned.

A weaker limit than core.signals.conditioning.AT_REST, which decides on a baseline, and beside the noise, which is known
here: earlier motion only biases a gain."""
FEWEST_LINES = 20
"""Fewest lines of the spectra. Not tuned."""
BLOCKS = 8
"""Stretches of lines whose residuals are independent. A choice: each is some ten lines, wider than a mode."""
LARGEST = 100.0
"""Largest ratio of a floor's power to the base slab's by which the base slab's noise counts. A choice."""
PER_FLOOR = 5
"""Unknowns of each floor: g, g c, g γ, the delay in the middle of the record and its rate."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorAgreement:
    """Differences of the floors from the base slab: logarithm of gain, delay in the middle of the record, rate of
    delay."""

    value: Vector
    """(3 floors,) 1, s and s/s, floor by floor."""
    covariance: Matrix
    """(3 floors, 3 floors)."""


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Spectra under a Hann window."""

    frequency: Vector
    """(lines,) Hz."""
    base: ComplexMatrix
    """(2, lines) a_base and −a_base''."""
    floors: ComplexMatrix
    """(floors, lines)."""
    lag: ComplexMatrix
    """(floors, lines) t times the slope: the derivative by a rate of delay."""
    noise: Vector
    """(1 + floors,) power of the noise alone in each line."""
    excitation: ComplexVector
    """(m + 1,) transform of a_base and as many zeros, up to SAMPLED / 2: it excites the mode from rest."""
    window: Vector
    """(m,) under which the mode's motion is seen."""
    duration: float
    """s, of the record."""

    @property
    def excited(self) -> Vector:
        """(m + 1,) Hz, frequencies of the excitation."""
        return np.arange(self.excitation.size) / (2 * self.duration)

    def up_to(self, highest: float) -> "_Lines":
        """Lines from LOWEST up to a frequency in Hz."""
        within = (self.frequency >= LOWEST) & (self.frequency <= highest)
        return replace(
            self,
            frequency=self.frequency[within],
            base=self.base[:, within],
            floors=self.floors[:, within],
            lag=self.lag[:, within],
        )


def floor_agreement(base: Vector, floors: Matrix, rate: float) -> FloorAgreement | None:
    """Differences between the floors' sensors and the base slab's in one event.

    Args:
        base: (n,) m/s².
        floors: (floors, n) m/s², one at least.
        rate: Hz.

    Returns:
        None if the record is too short, or begins in motion: free vibration of the mode would appear as a gain.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    whole = _lines(base, floors, rate)
    if not _begins_at_rest(np.vstack([base, floors]), whole.noise, rate):
        return None
    searched = whole.up_to(HIGHEST * FREQUENCIES[-1])
    first = min(FREQUENCIES, key=lambda frequency: _remainder(searched, frequency))
    lines = whole.up_to(HIGHEST * first)
    if lines.frequency.size < FEWEST_LINES:
        return None
    shares = _shares(lines, _columns(lines, first, DAMPING))
    start = [np.log(first), np.log(DAMPING), *np.ravel([[*own, 0.0, 0.0] for own in shares])]
    columns = cache(partial(_columns, lines))  # most of the unknowns do not affect the mode

    def residual(unknown: Vector) -> Vector:
        frequency, damping = np.exp(unknown[:2]).tolist()
        return _residual(lines, columns(frequency, damping), unknown[2:].reshape(-1, PER_FLOOR))

    def slopes(unknown: Vector) -> Matrix:
        frequency, damping = np.exp(unknown[:2]).tolist()
        changes = _changes_of_mode(lines, frequency, damping)
        return _slopes(lines, columns(frequency, damping), changes, unknown[2:].reshape(-1, PER_FLOOR))

    solution = scipy.optimize.least_squares(residual, start, slopes, x_scale="jac", method="lm")
    covariance = _covariance(solution.jac, solution.fun, len(floors))
    gains = solution.x[2::PER_FLOOR]
    if not (gains > 0).all():
        return None
    places = np.arange(2, solution.x.size).reshape(-1, PER_FLOOR)[:, [0, 3, 4]].ravel()
    value, change = solution.x[places], np.ones(places.size)
    value[::3], change[::3] = np.log(gains), 1 / gains
    own = covariance[np.ix_(places, places)] * np.outer(change, change)
    return FloorAgreement(value, own)


def _covariance(slopes: Matrix, residual: Vector, floors: int) -> Matrix:
    """(unknowns, unknowns) of the fit: of the noise, and of what the model leaves beyond it.

    Noise is independent from line to line and from floor to floor. What a model leaves that lacks a mode, as of a tuned
    mass, is neither: it is shared by neighbouring lines and by all floors, and passes for a late clock. The sum over
    BLOCKS of lines that are independent of each other allows for it (Liang & Zeger 1986), as far as the residual
    exceeds the noise.

    Args:
        slopes: (residuals, unknowns) derivatives of the residuals.
        residual: (residuals,) floor by floor, line by line, real and imaginary part.
        floors: number.
    """
    inverse = scaled_inverse(slopes.T @ slopes)
    left = max(float(residual @ residual) / max(1, residual.size - slopes.shape[1]), 1.0)
    pull = (slopes * residual[:, None]).reshape(floors, -1, 2, slopes.shape[1]).sum(axis=(0, 2))
    blocks = np.array([block.sum(axis=0) for block in np.array_split(pull, BLOCKS)]) @ inverse
    shared = blocks.T @ blocks * BLOCKS / (BLOCKS - 1)
    return np.asarray(inverse * HANN_CORRELATION * left + shared * (1 - 1 / left))


def _begins_at_rest(samples: Matrix, noise: Vector, rate: float) -> bool:
    window = np.sum(scipy.signal.windows.hann(samples.shape[1], sym=False) ** 2)
    first = samples[:, : round(BEGINNING * rate)].std(axis=1)
    return bool((first < AT_REST * samples.std(axis=1) + 2 * np.sqrt(noise / window)).all())


def _lines(base: Vector, floors: Matrix, rate: float) -> _Lines:
    count = base.size
    frequency: Vector = np.asarray(np.fft.rfftfreq(count, 1 / rate), dtype=float)
    window = scipy.signal.windows.hann(count, sym=False)
    spectra = np.fft.rfft(window * np.vstack([base, floors]), axis=1)
    bend = -np.fft.rfft(window * np.gradient(np.gradient(base)) * rate**2)
    noise = noise_density(np.vstack([base, floors]), rate) * rate / 2 * np.sum(window**2)
    time = (np.arange(count) - (count - 1) / 2) / rate
    lag = np.fft.rfft(window * time * np.gradient(floors, axis=1) * rate, axis=1)
    excitation = np.fft.rfft(base, 2 * count)[: min(count, round(SAMPLED * count / rate)) + 1]
    seen = scipy.signal.windows.hann(excitation.size - 1, sym=False)
    return _Lines(frequency, np.array([spectra[0], bend]), spectra[1:], lag, noise, excitation, seen, count / rate)


def _mode(lines: _Lines, frequency: float, damping: float) -> ComplexVector:
    """(lines,) spectrum of q'' under the window; the oscillator is at rest before the record."""
    return _seen(lines, _transfer(lines, frequency, damping))


def _changes_of_mode(lines: _Lines, frequency: float, damping: float) -> ComplexMatrix:
    """(2, lines) derivatives of `_mode` by the logarithms of frequency and damping ratio."""
    f, transfer = lines.excited, _transfer(lines, frequency, damping)
    per = np.divide(-(transfer**2), f**2, out=np.zeros_like(transfer), where=f > 0)
    by_damping = 2j * damping * frequency * f
    return np.array([_seen(lines, per * (2 * frequency**2 + by_damping)), _seen(lines, per * by_damping)])


def _transfer(lines: _Lines, frequency: float, damping: float) -> ComplexVector:
    """(m + 1,) q'' over a_base."""
    f = lines.excited
    return np.asarray(f**2 / (frequency**2 - f**2 + 2j * damping * frequency * f))


def _seen(lines: _Lines, transfer: ComplexVector) -> ComplexVector:
    """(lines,) spectrum under the window of a motion that a_base excites from rest."""
    count = lines.excitation.size - 1
    history = np.fft.irfft(lines.excitation * transfer, 2 * count)[:count]
    spectrum = np.fft.rfft(lines.window * history)
    first = round(lines.frequency[0] * lines.duration)
    return np.asarray(spectrum[first : first + lines.frequency.size])


def _columns(lines: _Lines, frequency: float, damping: float) -> ComplexMatrix:
    return np.array([lines.base[0], _mode(lines, frequency, damping), lines.base[1]])


def _shares(lines: _Lines, columns: ComplexMatrix) -> Matrix:
    """(floors, 3) g, g c and g γ without delay."""
    normal, right = (columns @ columns.conj().T).real, (columns.conj() @ lines.floors.T).real
    return np.asarray(np.linalg.lstsq(normal, right, rcond=None)[0].T)


def _remainder(lines: _Lines, frequency: float) -> float:
    columns = _columns(lines, frequency, DAMPING)
    return float(np.linalg.norm(lines.floors - _shares(lines, columns) @ columns))


def _residual(lines: _Lines, columns: ComplexMatrix, unknown: Matrix) -> Vector:
    """Residuals of all floors in standard deviations of the noise, real and imaginary parts."""
    return np.concatenate([residual.view(float) for residual, *_ in _each_floor(lines, columns, unknown)])


def _slopes(lines: _Lines, columns: ComplexMatrix, changes: ComplexMatrix, unknown: Matrix) -> Matrix:
    """(residuals, unknowns) derivatives of `_residual`.

    Args:
        lines: of the record.
        columns: (3, lines) what a floor's motion is made of.
        changes: (2, lines) of the second column by the mode's unknowns.
        unknown: (floors, PER_FLOOR).
    """
    size = 2 * lines.frequency.size
    found = np.zeros((len(unknown) * size, 2 + unknown.size))
    for number, (residual, turned, std, weaker) in enumerate(_each_floor(lines, columns, unknown)):
        by_mode = unknown[number, 1] * changes
        expected = np.concatenate([by_mode, columns])
        by_expected = -expected / std - residual * (weaker * expected).real
        late = np.exp(2j * np.pi * lines.frequency * unknown[number, 3])
        by_clock = np.array([2j * np.pi * lines.frequency * turned, lines.lag[number] * late]) / std
        rows = np.ascontiguousarray(np.concatenate([by_expected, by_clock])).view(float).T
        own, first = slice(number * size, (number + 1) * size), 2 + number * PER_FLOOR
        found[own, :2], found[own, first : first + PER_FLOOR] = rows[:, :2], rows[:, 2:]
    return found


def _each_floor(
    lines: _Lines, columns: ComplexMatrix, unknown: Matrix
) -> Iterator[tuple[ComplexVector, ComplexVector, Vector, ComplexVector]]:
    """Four (lines,) series of each floor: the residual in standard deviations of the noise; the recorded spectrum with
    its clock corrected; the standard deviation; and the derivative of its logarithm by the expected spectrum. A change
    of the expected spectrum times this derivative has the change of the logarithm as its real part."""
    ω, base = 2 * np.pi * lines.frequency, np.maximum(np.abs(lines.base[0]) ** 2, np.finfo(float).tiny)
    for own, lag, power, (*shares, delay, slow) in zip(lines.floors, lines.lag, lines.noise[1:], unknown, strict=True):
        expected = np.array(shares) @ columns
        ratio = np.abs(expected) ** 2 / base
        std = np.sqrt((power + np.minimum(ratio, LARGEST) * lines.noise[0]) / 2)
        turned = (own + slow * lag) * np.exp(1j * ω * delay)
        weaker = np.where(ratio < LARGEST, lines.noise[0] * expected.conj() / (2 * base * std**2), 0.0)
        yield (turned - expected) / std, turned, std, weaker
