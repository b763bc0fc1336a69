"""Refinement of identified modes: maximum likelihood with noise in the input and in the outputs.

The subspace's poles are the start of an errors-in-variables fit, to which modes that the subspace missed are added as
long as the spectra support them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from scipy import ndimage

from core.arrays import Matrix, Vector
from core.identification.errors_in_variables import (
    RESIDUAL_TERMS,
    SMOOTH_TERMS,
    ModalTransfer,
    NoisySpectra,
    TransferFit,
    cost,
    fit_transfer,
    least_squares_coefficients,
)
from core.identification.identified_modes import Identification, IdentifiedMode
from core.identification.missing_modes import with_missing_modes
from core.identification.modal_uncertainty import ModalDeviation
from core.identification.modes import modal_assurance
from core.signals.noise import noise_density

LOWEST_LINE = 0.2
"""Hz, lowest line of the fit: below it, sensors drift."""
LEAST_NOISE = 1e-6
"""Lowest noise of a channel relative to its standard deviation: no recorder has less."""
SMOOTHING_BANDWIDTH = 1.0
"""Hz, over which a spectrum is averaged before it is compared with the noise. A choice."""
LEAST_POWER = 1.5
"""Smoothed power over noise, averaged over the floors, below which a line holds no information about the modes. A
choice."""
BAND_MARGIN = 1.2
"""Ratio of the band's upper end to the highest mode's frequency, at least. A choice."""
LARGEST_MISFIT = 4.0
"""Chi-square per degree of freedom of residuals that are twice the noise.

Above it the error is not noise but the model, and the spectra do not show which channel causes it. A choice."""
HOPELESS_MISFIT = 100.0
"""Chi-square per degree of freedom that no missing mode reduces to LARGEST_MISFIT. A choice."""
LARGEST_DAMPING_RATIO = 0.2
"""A pole with more damping is not a mode of a superstructure. A choice."""
LOWEST_MISSING_MODE = 0.5
"""Hz, lowest frequency at which a missing mode is searched for. A choice."""
SAME_FREQUENCY = 0.1
"""Largest relative distance between a mode and its refinement. A choice."""
SAME_SHAPE = 0.8
"""Smallest modal assurance criterion between a mode and its refinement. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """Refined modes, with the misfit of the fit that refined them."""

    modes: tuple[IdentifiedMode, ...]
    """As many as were given. Those with a shape covariance are refined, the others unchanged."""
    misfit: float | None
    """Chi-square per degree of freedom of the fit, 1 if noise explains the whole residual; None without a fit, for
    which the record has too few lines.

    Above 1, it enlarges the standard deviations by its square root; above LARGEST_MISFIT, no mode is refined.
    """


def refined(
    modes: Sequence[IdentifiedMode],
    base_acceleration: Vector,
    floor_acceleration: Matrix,
    rate: float,
    identification: Identification,
) -> Refinement:
    """Most likely modes if the base slab's record is as noisy as the floors'.

    Args:
        modes: as identified, at least one; the start of the fit.
        base_acceleration: (n,) m/s², absolute.
        floor_acceleration: (measured, n) m/s², absolute.
        rate: Hz.
        identification: the settings with which the modes were identified.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    highest = identification.stability.highest_frequency * min(rate, identification.rate)
    band = min(BAND_MARGIN * modes[-1].frequency, highest), highest
    lines = noisy_spectra(base_acceleration, floor_acceleration, rate, band)
    fit = _most_likely(modes, lines)
    if fit is None or not fit.converged or fit.misfit > LARGEST_MISFIT:
        return Refinement(tuple(modes), None if fit is None else fit.misfit)
    better = [_mode(fit, number) for number in range(fit.transfer.angular_frequency.size)]
    return Refinement(_replaced(modes, better), fit.misfit)


def noisy_spectra(
    base_acceleration: Vector, floor_acceleration: Matrix, rate: float, upper: tuple[float, float]
) -> NoisySpectra:
    """Spectra from LOWEST_LINE up to the highest frequency at which the floors move more than their noise.

    The noise is estimated from the record.

    Args:
        base_acceleration: (n,) m/s², absolute.
        floor_acceleration: (measured, n) m/s², absolute.
        rate: Hz.
        upper: Hz, lowest and highest upper end of the band.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    series = np.vstack([base_acceleration, floor_acceleration])
    frequency = np.fft.rfftfreq(series.shape[1], 1 / rate)
    spectra = np.fft.rfft(series, axis=1) / np.sqrt(series.shape[1])
    noise = np.sqrt(noise_density(series, rate) * rate / 2)
    noise = np.maximum(noise, LEAST_NOISE * np.std(series, axis=1))
    power = np.mean(np.abs(spectra[1:] / noise[1:, None]) ** 2, axis=0)
    smooth = ndimage.uniform_filter1d(power, max(1, round(SMOOTHING_BANDWIDTH / frequency[1])))
    moves = (smooth > LEAST_POWER) & (frequency <= upper[1])
    used = (frequency >= LOWEST_LINE) & (frequency <= max(upper[0], *frequency[moves], LOWEST_LINE))
    # numpy lays out a choice of columns by columns
    return NoisySpectra(np.asarray(2 * np.pi * frequency[used]), np.ascontiguousarray(spectra[:, used]), noise)


def _most_likely(modes: Sequence[IdentifiedMode], lines: NoisySpectra) -> TransferFit | None:
    """Fit that starts from the modes, or from all but the highest, which may be one mode split in two.

    None if there are too few lines.
    """
    start = _start(modes, lines)
    if lines.angular_frequency.size * len(start.forced) < start.parameters.size:
        return None
    fit = fit_transfer(start, lines)
    if not fit.converged and len(modes) > 1:
        fit = fit_transfer(_start(modes[:-1], lines), lines)
    if fit.misfit > HOPELESS_MISFIT or not np.isfinite(fit.inverse_information).all():
        return fit
    return with_missing_modes(fit, lines, 2 * np.pi * LOWEST_MISSING_MODE)


def _start(modes: Sequence[IdentifiedMode], lines: NoisySpectra) -> ModalTransfer:
    """Transfer with the modes' poles that fits the spectra best, with a transient if the spectra support one."""
    floors, m = len(lines.spectra) - 1, len(modes)
    poles = ModalTransfer(
        angular_frequency=np.array([2 * np.pi * mode.frequency for mode in modes]),
        damping_ratio=np.array([mode.damping_ratio for mode in modes]),
        forced=np.zeros((floors, m + RESIDUAL_TERMS)),
        transient=np.zeros((floors, 0)),
        delay=np.zeros(floors),
        scale=float(lines.angular_frequency[-1]),
    )
    at_rest = _fitted(poles, lines)
    cut = _fitted(replace(poles, transient=np.zeros((floors, 2 * m + SMOOTH_TERMS))), lines)
    misfit = cost(cut, lines) / (floors * lines.angular_frequency.size)
    is_cut = cost(at_rest, lines) - cost(cut, lines) > cut.transient.size * misfit  # Akaike (1974)
    return cut if is_cut else at_rest


def _fitted(poles: ModalTransfer, lines: NoisySpectra) -> ModalTransfer:
    return least_squares_coefficients(poles, lines.angular_frequency, lines.spectra[0], lines.spectra[1:], lines.noise)


def _mode(fit: TransferFit, i: int) -> IdentifiedMode:
    """Mode i of the fitted transfer, with its uncertainty."""
    transfer = fit.transfer
    m, floors = transfer.angular_frequency.size, len(transfer.forced)
    row = transfer.forced.shape[1] + transfer.transient.shape[1] + 1
    std = np.sqrt(np.diag(fit.covariance))
    at_floors = 2 * m + i + row * np.arange(floors)
    shape = transfer.forced[:, i]
    # 1 at the last floor: s = φ / φ_last, ds = (dφ - s dφ_last) / φ_last
    change = (np.eye(floors) - np.outer(shape / shape[-1], np.eye(floors)[-1])) / shape[-1]
    return IdentifiedMode(
        frequency=float(transfer.angular_frequency[i] / (2 * np.pi)),
        damping_ratio=float(transfer.damping_ratio[i]),
        shape=shape.astype(complex),
        deviation=ModalDeviation(float(std[i] / (2 * np.pi)), float(std[m + i])),
        shape_covariance=change @ fit.covariance[np.ix_(at_floors, at_floors)] @ change.T,
    )


def _replaced(modes: Sequence[IdentifiedMode], better: Sequence[IdentifiedMode]) -> tuple[IdentifiedMode, ...]:
    """The refinement of each mode, or the mode itself if it has none."""
    distance = np.array([[_distance(mode, other) for other in better] for mode in modes])
    rows, columns = scipy.optimize.linear_sum_assignment(distance)
    result = list(modes)
    for row, column in zip(rows, columns, strict=True):
        if distance[row, column] < 1:
            result[row] = better[column]
    return tuple(result)


def _distance(mode: IdentifiedMode, other: IdentifiedMode) -> float:
    """Distance between a mode and its possible refinement, 1 if the other is not its refinement."""
    apart = abs(other.frequency / mode.frequency - 1) / SAME_FREQUENCY
    is_alike = modal_assurance(mode.shape, other.shape) >= SAME_SHAPE
    is_determined = (
        other.deviation is not None and other.deviation.damping_ratio < other.damping_ratio < LARGEST_DAMPING_RATIO
    )
    return min(apart, 1.0) if is_alike and is_determined else 1.0
