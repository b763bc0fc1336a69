"""The identified modes made most likely, with noise in the input and in the outputs allowed for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage, optimize

from core.arrays import Matrix, Vector
from core.identification.errors_in_variables import Fit, NoisyLines, cost, fit
from core.identification.identified_modes import Identification, IdentifiedMode
from core.identification.missing_modes import with_missing_modes
from core.identification.modal_transfer import RESIDUAL_TERMS, SMOOTH_TERMS, ModalTransfer, fitted_coefficients
from core.identification.modal_uncertainty import ModalDeviation
from core.identification.modes import modal_assurance
from core.signals.noise import noise_density

LOWEST = 0.2
"""Hz, of the lines that are used: below it sensors drift."""
RESOLUTION = 1e-6
"""Of a channel's standard deviation: no recorder has less noise."""
SMOOTHED = 1.0
"""Hz, over which a spectrum is averaged to tell motion from noise."""
MOVING = 1.5
"""Times the noise's power: what is below tells nothing of the modes."""
BEYOND = 1.2
"""Of the highest mode's frequency: the least upper end of the band."""
LOWEST_MODE = 0.5
"""Hz, from which modes are looked for that the subspace did not show."""
SAME_FREQUENCY = 0.1
"""Relative distance up to which a refined mode is the one that was to be refined."""
SAME_SHAPE = 0.8
"""Modal assurance criterion from which on it is."""
LARGEST_MISFIT = 4.0
"""Errors of twice the noise. Beyond it is not noise that keeps the model from the record, and there is no telling
which of the channels holds what keeps it."""
HOPELESS_MISFIT = 100.0
"""No missing mode brings this down to LARGEST_MISFIT."""
LARGEST_RATIO = 0.2
"""More damping than that is no mode of a superstructure."""


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """Modes with noise in every channel allowed for, and how far that went."""

    modes: tuple[IdentifiedMode, ...]
    """As many as were given; those with a shape covariance are refined, the others stand as they were."""
    misfit: float | None
    """Chi-square per degree of freedom of the fit, 1 where noise explains all it leaves; None without a fit, of which
    the record holds too little.

    Where it is above 1 the standard deviations were made larger by its root; above LARGEST_MISFIT nothing is refined.
    """


def refined(
    modes: Sequence[IdentifiedMode],
    base_acceleration: Vector,
    floor_acceleration: Matrix,
    rate: float,
    identification: Identification,
) -> Refinement:
    """The modes that are most likely when the base slab's record is as noisy as the floors'.

    Args:
        modes: as identified, at least one: where to start.
        base_acceleration: (n,) m/s², absolute.
        floor_acceleration: (measured, n) m/s², absolute.
        rate: Hz.
        identification: the choices that the modes were identified with.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    highest = identification.stability.highest_frequency * min(rate, identification.rate)
    band = min(BEYOND * modes[-1].frequency, highest), highest
    lines = noisy_lines(base_acceleration, floor_acceleration, rate, band)
    found = _most_likely(modes, lines)
    if found is None or not found.converged or found.misfit > LARGEST_MISFIT:
        return Refinement(tuple(modes), None if found is None else found.misfit)
    better = [_mode(found, number) for number in range(found.transfer.angular_frequency.size)]
    return Refinement(_replaced(modes, better), found.misfit)


def _most_likely(modes: Sequence[IdentifiedMode], lines: NoisyLines) -> Fit | None:
    """The fit from the modes as identified, or without the highest, which may be two in one; None of too few lines."""
    start = _start(modes, lines)
    if lines.angular_frequency.size * len(start.driven) < start.parameters.size:
        return None
    found = fit(start, lines)
    if not found.converged and len(modes) > 1:
        found = fit(_start(modes[:-1], lines), lines)
    if found.misfit > HOPELESS_MISFIT or not np.isfinite(found.inverse_information).all():
        return found
    return with_missing_modes(found, lines, 2 * np.pi * LOWEST_MODE)


def noisy_lines(
    base_acceleration: Vector, floor_acceleration: Matrix, rate: float, upper: tuple[float, float]
) -> NoisyLines:
    """Spectra from LOWEST to where the floors no longer move more than their noise, which the record itself shows.

    Args:
        base_acceleration: (n,) m/s², absolute.
        floor_acceleration: (measured, n) m/s², absolute.
        rate: Hz.
        upper: Hz, up to where lines are used in any case, and beyond which none is.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    series = np.vstack([base_acceleration, floor_acceleration])
    frequency = np.fft.rfftfreq(series.shape[1], 1 / rate)
    spectra = np.fft.rfft(series, axis=1) / np.sqrt(series.shape[1])
    noise = np.sqrt(noise_density(series, rate) * rate / 2)
    noise = np.maximum(noise, RESOLUTION * np.std(series, axis=1))
    power = np.mean(np.abs(spectra[1:] / noise[1:, None]) ** 2, axis=0)
    smooth = ndimage.uniform_filter1d(power, max(1, round(SMOOTHED / frequency[1])))
    moves = (smooth > MOVING) & (frequency <= upper[1])
    used = (frequency >= LOWEST) & (frequency <= max(upper[0], *frequency[moves], LOWEST))
    return NoisyLines(np.asarray(2 * np.pi * frequency[used]), spectra[:, used], noise)


def _start(modes: Sequence[IdentifiedMode], lines: NoisyLines) -> ModalTransfer:
    """The transfer with the identified poles that is nearest to the spectra, as of a record that was cut if need be."""
    floors, m = len(lines.spectra) - 1, len(modes)
    poles = ModalTransfer(
        angular_frequency=np.array([2 * np.pi * mode.frequency for mode in modes]),
        damping_ratio=np.array([mode.damping_ratio for mode in modes]),
        driven=np.zeros((floors, m + RESIDUAL_TERMS)),
        free=np.zeros((floors, 0)),
        delay=np.zeros(floors),
        scale=float(lines.angular_frequency[-1]),
    )
    at_rest = _fitted(poles, lines)
    cut = _fitted(replace(poles, free=np.zeros((floors, 2 * m + SMOOTH_TERMS))), lines)
    misfit = cost(cut, lines) / (floors * lines.angular_frequency.size)
    is_cut = cost(at_rest, lines) - cost(cut, lines) > cut.free.size * misfit  # Akaike (1974)
    return cut if is_cut else at_rest


def _fitted(poles: ModalTransfer, lines: NoisyLines) -> ModalTransfer:
    return fitted_coefficients(poles, lines.angular_frequency, lines.spectra[0], lines.spectra[1:], lines.noise)


def _mode(found: Fit, i: int) -> IdentifiedMode:
    transfer = found.transfer
    m, floors = transfer.angular_frequency.size, len(transfer.driven)
    row = transfer.driven.shape[1] + transfer.free.shape[1] + 1
    std = np.sqrt(np.diag(found.covariance))
    at_floors = 2 * m + i + row * np.arange(floors)
    shape = transfer.driven[:, i]
    # 1 at the last floor: s = φ / φ_last, ds = (dφ - s dφ_last) / φ_last
    change = (np.eye(floors) - np.outer(shape / shape[-1], np.eye(floors)[-1])) / shape[-1]
    return IdentifiedMode(
        frequency=float(transfer.angular_frequency[i] / (2 * np.pi)),
        damping_ratio=float(transfer.damping_ratio[i]),
        shape=shape.astype(complex),
        deviation=ModalDeviation(float(std[i] / (2 * np.pi)), float(std[m + i])),
        shape_covariance=change @ found.covariance[np.ix_(at_floors, at_floors)] @ change.T,
    )


def _replaced(modes: Sequence[IdentifiedMode], better: Sequence[IdentifiedMode]) -> tuple[IdentifiedMode, ...]:
    """Each mode's refined counterpart, or the mode itself where there is none."""
    distance = np.array([[_distance(mode, other) for other in better] for mode in modes])
    rows, columns = optimize.linear_sum_assignment(distance)
    result = list(modes)
    for row, column in zip(rows, columns, strict=True):
        if distance[row, column] < 1:
            result[row] = better[column]
    return tuple(result)


def _distance(mode: IdentifiedMode, other: IdentifiedMode) -> float:
    """Between a mode and what may be its refinement: below 1 if it is."""
    apart = abs(other.frequency / mode.frequency - 1) / SAME_FREQUENCY
    is_alike = modal_assurance(mode.shape, other.shape) >= SAME_SHAPE
    is_determined = other.deviation is not None and other.deviation.damping_ratio < other.damping_ratio < LARGEST_RATIO
    return min(apart, 1.0) if is_alike and is_determined else 1.0
