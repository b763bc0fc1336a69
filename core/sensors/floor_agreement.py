"""By which gains and delays do the floors' sensors disagree with the base slab's?

Up to a little above the first fixed-base frequency a floor moves as the base slab, with the first mode and with what
higher ones add as if they were static: a = g (a_base + c q'' − γ a_base''), q an oscillator driven by a_base that all
floors have in common. Where the frequency goes to 0 both vanish: what is left is the gain g, and a delay beside.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from core.arrays import ComplexMatrix, Matrix, Vector
from core.signals.noise import noise_density

LOWEST = 0.15
"""Hz."""
HIGHEST = 1.2
"""Of the first fixed-base frequency: far enough below the second."""
FREQUENCIES = np.geomspace(0.6, 4.0, 28)
"""Hz, first fixed-base frequencies among which the search begins."""
DAMPING = 0.02
"""Of the first mode, with which the search begins."""
BEGINNING = 2.0
"""s, in which a record that begins at rest hardly moves."""
AT_REST = 0.1
"""Of a channel's standard deviation."""
CORRELATED = 1 + 2 * (4 / 9 + 1 / 36)
"""By how much neighbouring lines of a Hann window know less than as many free of each other (Harris, 1978)."""
FEWEST_LINES = 20
PER_FLOOR = 5
"""Unknowns of each floor: g, g c, g γ, a delay at the record's middle and its rate."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorAgreement:
    """Of each floor against the base slab: logarithm of gain, delay at the record's middle, rate of delay."""

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
    """(2, lines) of a_base, and of −a_base''."""
    floors: ComplexMatrix
    """(floors, lines)."""
    lag: ComplexMatrix
    """(floors, lines) of t times the slope, by which a rate of delay shows."""
    noise: Matrix
    """(1 + floors,) power that noise alone has in each line."""
    samples: Vector
    """(n,) m/s², of the base slab."""
    rate: float

    def up_to(self, highest: float) -> "_Lines":
        """The lines from LOWEST up to a frequency in Hz."""
        within = (self.frequency >= LOWEST) & (self.frequency <= highest)
        return _Lines(
            self.frequency[within],
            self.base[:, within],
            self.floors[:, within],
            self.lag[:, within],
            self.noise,
            self.samples,
            self.rate,
        )


def floor_agreement(base: Vector, floors: Matrix, rate: float) -> FloorAgreement | None:
    """How far the floors' sensors agree with the base slab's in one event.

    Args:
        base: (n,) m/s².
        floors: (floors, n) m/s², one at least.
        rate: Hz.

    Returns:
        None where the record is too short, or begins in motion: the mode's own start would be taken for a gain.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    whole = _lines(base, floors, rate)
    if not _begins_at_rest(np.vstack([base, floors]), whole):
        return None
    first = min(FREQUENCIES, key=lambda frequency: _left(whole.up_to(HIGHEST * FREQUENCIES[-1]), frequency))
    lines = whole.up_to(HIGHEST * first)
    if lines.frequency.size < FEWEST_LINES:
        return None
    start = [
        np.log(first),
        np.log(DAMPING),
        *np.ravel([[*_linear(lines, own, first), 0.0, 0.0] for own in lines.floors]),
    ]
    found = least_squares(lambda unknown: _residual(lines, unknown), start, x_scale="jac", method="lm")
    left = 2 * found.cost / max(1, found.fun.size - found.x.size)
    normal = found.jac.T @ found.jac
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    covariance = np.linalg.pinv(normal * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
    gains = found.x[2::PER_FLOOR]
    if not (gains > 0).all():
        return None
    places = np.arange(2, found.x.size).reshape(-1, PER_FLOOR)[:, [0, 3, 4]].ravel()
    value, change = found.x[places], np.ones(places.size)
    value[::3], change[::3] = np.log(gains), 1 / gains
    own = covariance[np.ix_(places, places)] * np.outer(change, change)
    return FloorAgreement(value, own * CORRELATED * max(left, 1.0))


def _begins_at_rest(samples: Matrix, lines: _Lines) -> bool:
    window = np.sum(np.hanning(samples.shape[1]) ** 2)
    noise = np.sqrt(lines.noise / window)
    first = samples[:, : round(BEGINNING * lines.rate)].std(axis=1)
    return bool((first < AT_REST * samples.std(axis=1) + 2 * noise).all())


def _lines(base: Vector, floors: Matrix, rate: float) -> _Lines:
    count = base.size
    frequency: Vector = np.asarray(np.fft.rfftfreq(count, 1 / rate), dtype=float)
    window = np.hanning(count)
    spectra = np.fft.rfft(window * np.vstack([base, floors]), axis=1)
    bend = -np.fft.rfft(window * np.gradient(np.gradient(base)) * rate**2)
    noise = noise_density(np.vstack([base, floors]), rate) * rate / 2 * np.sum(window**2)
    time = (np.arange(count) - (count - 1) / 2) / rate
    lag = np.fft.rfft(window * time * np.gradient(floors, axis=1) * rate, axis=1)
    return _Lines(frequency, np.array([spectra[0], bend]), spectra[1:], lag, noise, base, rate)


def _mode(lines: _Lines, frequency: float, damping: float) -> ComplexMatrix:
    """(lines,) spectrum of q'' under the window; the oscillator is at rest before the record."""
    size = 2 * lines.samples.size
    f = np.fft.rfftfreq(size, 1 / lines.rate)
    transfer = f**2 / (frequency**2 - f**2 + 2j * damping * frequency * f)
    history = np.fft.irfft(np.fft.rfft(lines.samples, size) * transfer, size)[: lines.samples.size]
    spectrum = np.fft.rfft(np.hanning(history.size) * history)
    first = round(lines.frequency[0] * lines.samples.size / lines.rate)
    return np.asarray(spectrum[first : first + lines.frequency.size])


def _columns(lines: _Lines, frequency: float, damping: float) -> ComplexMatrix:
    return np.array([lines.base[0], _mode(lines, frequency, damping), lines.base[1]])


def _linear(lines: _Lines, own: ComplexMatrix, frequency: float) -> Vector:
    """(3,) g, g c and g γ of a floor without delay."""
    columns = _columns(lines, frequency, DAMPING)
    shares = np.linalg.lstsq((columns @ columns.conj().T).real, (columns.conj() @ own).real, rcond=None)[0]
    return np.asarray(shares, dtype=float)


def _left(lines: _Lines, frequency: float) -> float:
    columns = _columns(lines, frequency, DAMPING)
    residual = [own - _linear(lines, own, frequency) @ columns for own in lines.floors]
    return float(np.linalg.norm(residual))


def _residual(lines: _Lines, unknown: Vector) -> Vector:
    """What is left of all floors in standard deviations of the noise, real and imaginary parts."""
    columns = _columns(lines, float(np.exp(unknown[0])), float(np.exp(unknown[1])))
    ω, parts = 2 * np.pi * lines.frequency, []
    for own, lag, power, (*shares, delay, slow) in zip(
        lines.floors, lines.lag, lines.noise[1:], unknown[2:].reshape(-1, PER_FLOOR), strict=True
    ):
        expected = np.array(shares) @ columns
        ratio = np.abs(expected) ** 2 / np.maximum(np.abs(lines.base[0]) ** 2, np.finfo(float).tiny)
        std = np.sqrt((power + np.minimum(ratio, 100.0) * lines.noise[0]) / 2)
        parts.append(((own + slow * lag) * np.exp(1j * ω * delay) - expected) / std)
    return np.concatenate([part.view(float) for part in parts])
