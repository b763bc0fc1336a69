"""Search for modes that a fitted transfer lacks, by score tests on the residual spectra."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import log

import numpy as np
from scipy import special

from core.arrays import ComplexMatrix, Matrix, Vector
from core.identification.errors_in_variables import (
    ModalTransfer,
    NoisySpectra,
    TransferFit,
    basis_functions,
    delay_factor,
    fit_transfer,
    floor_derivatives,
    profiled_base_motion,
)
from core.signals.spectra import squared

FREQUENCY_STEP = 1.06
"""Ratio of one trial frequency to the previous one: about the half-power bandwidth at the trial damping ratio."""
TRIAL_DAMPING_RATIO = 0.04
"""Damping ratio of a trial mode; the fit then estimates it. A choice."""
MOST_TRIALS = 2
"""Trial frequencies from which a further mode is fitted: those with the largest expected gain."""
LEAST_GAIN = 3.0
"""Gain of twice the log-likelihood per parameter from which a mode is added.

Akaike's criterion is two; the best of many frequencies needs more."""
LARGEST_DAMPING_RATIO = 0.3
"""A pole with more damping describes the background of the spectrum. A choice."""
TRIAL_DISTANCE = 0.06
"""Smallest relative distance of a trial frequency from a known mode. A choice."""
LEAST_SPACING = 0.02
"""Smallest relative distance between two modes: closer ones are a single mode split in two."""


@dataclass(frozen=True, slots=True, eq=False)
class _TrialModes:
    """Further modes at trial frequencies, with the first-order effects of adding each by Rao's score test."""

    angular_frequency: Vector
    """(trials,) rad/s."""
    gain: Vector
    """(trials,) expected gain of twice the log-likelihood, with the noise scaled by the misfit."""
    forced: Matrix
    """(trials, floors) expected shapes times participation factors."""
    change: Matrix
    """(trials, parameters) expected changes of the known modes' parameters."""


def with_missing_modes(fit: TransferFit, lines: NoisySpectra, lowest: float) -> TransferFit:
    """The fit with every further mode that the spectra support.

    A missing mode biases its neighbours' damping ratios by several of their standard deviations long before chi-square
    shows it. The covariance therefore includes the changes by the modes that are still left out, each weighted by its
    probability. This is a first-order correction: the highest mode represents all modes above the band and may have a
    larger error.

    Args:
        fit: with the known modes.
        lines: the spectra.
        lowest: rad/s, below which no mode is searched for.
    """
    while True:
        trials = _trial_modes(fit, lines, _trial_frequencies(fit, lines, lowest))
        better = next(_better_fits(fit, lines, trials), None)
        if better is None:
            return _widened(fit, trials)
        fit = better


def _trial_frequencies(fit: TransferFit, lines: NoisySpectra, lowest: float) -> Vector:
    """(trials,) rad/s, without those near a known mode."""
    highest = float(lines.angular_frequency[-1])
    frequencies = np.geomspace(lowest, highest, max(2, round(log(highest / lowest, FREQUENCY_STEP))))
    known = fit.transfer.angular_frequency
    return frequencies[np.all(np.abs(frequencies[:, None] / known - 1) > TRIAL_DISTANCE, axis=1)]


def _better_fits(fit: TransferFit, lines: NoisySpectra, trials: _TrialModes) -> Iterator[TransferFit]:
    """Fits with one more mode that gain enough, in order of expected gain."""
    least_gain = LEAST_GAIN * _parameters_per_mode(fit.transfer)
    for i in np.argsort(-trials.gain)[:MOST_TRIALS]:
        if trials.gain[i] < least_gain:
            return
        frequency = float(trials.angular_frequency[i])
        start = _with_mode(_changed(fit.transfer, trials.change[i]), frequency, trials.forced[i])
        more = fit_transfer(start, lines)
        gain = 2 * (fit.cost - more.cost) / max(1.0, fit.misfit)
        is_determined = more.converged and np.isfinite(more.inverse_information).all()
        if is_determined and gain >= least_gain and _is_plausible(more.transfer):
            yield more


def _parameters_per_mode(transfer: ModalTransfer) -> int:
    """Parameters of one mode: frequency, damping ratio and, at each floor, one forced and two transient ones."""
    floors = len(transfer.forced)
    return 2 + floors + (2 * floors if transfer.transient.size else 0)


def _widened(fit: TransferFit, trials: _TrialModes) -> TransferFit:
    """The fit with the covariance of its average with all trials, by Akaike weights (Burnham and Anderson 2002)."""
    exponents = trials.gain / 2 - _parameters_per_mode(fit.transfer)
    weight = special.softmax(np.append(exponents, 0.0))[:-1]
    spread = trials.change.T @ (weight[:, None] * trials.change)
    return replace(fit, covariance=fit.covariance + spread)


def _is_plausible(transfer: ModalTransfer) -> bool:
    spacing = np.diff(np.log(np.sort(transfer.angular_frequency)))
    return bool(np.all(transfer.damping_ratio < LARGEST_DAMPING_RATIO) and np.all(spacing > LEAST_SPACING))


def _changed(transfer: ModalTransfer, change: Vector) -> ModalTransfer:
    """The transfer with the change added, or unchanged if a mode would no longer decay."""
    changed = transfer.plus(change)
    return changed if np.all(changed.damping_ratio > 0) and np.all(changed.angular_frequency > 0) else transfer


def _with_mode(transfer: ModalTransfer, angular_frequency: float, forced: Vector) -> ModalTransfer:
    """The transfer with one more mode, at the trial damping ratio."""
    m = transfer.angular_frequency.size
    transient = (
        np.insert(transfer.transient, [m, 2 * m], 0.0, axis=1) if transfer.transient.size else transfer.transient
    )
    return replace(
        transfer,
        angular_frequency=np.append(transfer.angular_frequency, angular_frequency),
        damping_ratio=np.append(transfer.damping_ratio, TRIAL_DAMPING_RATIO),
        forced=np.insert(transfer.forced, m, forced, axis=1),
        transient=transient,
    )


def _trial_modes(fit: TransferFit, lines: NoisySpectra, frequencies: Vector) -> _TrialModes:
    """Score test of a further mode at each of the (trials,) rad/s."""
    w = lines.angular_frequency
    basis = basis_functions(fit.transfer, w)
    a, r, g = profiled_base_motion(fit.transfer, basis, lines)
    square, w_c = np.sum(squared(g), axis=0), frequencies[:, None]
    mode: ComplexMatrix = np.multiply(w**2, np.reciprocal(w_c**2 - w**2 + 2j * TRIAL_DAMPING_RATIO * w_c * w))
    weight = np.asarray(a * delay_factor(fit.transfer, w) / lines.noise[1:, None])
    score = (mode.conj() @ (weight.conj() * r[1:]).T).real
    shared = np.zeros((*score.shape, len(fit.covariance)))
    along = np.zeros((len(fit.covariance), w.size), dtype=complex)
    known = [(parameters, change) for parameters, _, change in floor_derivatives(fit.transfer, basis, lines, a)]
    for (parameters, change), of_floor in zip(known, g[1:], strict=True):
        along[parameters] += change * (of_floor.conj() / square)
    for floor, (parameters, change) in enumerate(known):
        shared[:, floor, parameters] += (mode.conj() @ (weight[floor].conj() * change).T).real
        shared[:, floor] -= (mode.conj() @ (weight[floor].conj() * g[floor + 1] * along).T).real
    regression = shared @ fit.inverse_information
    remaining = _own_information(mode, weight, g, square) - regression @ shared.transpose(0, 2, 1)
    forced = np.asarray(np.linalg.solve(remaining, score[..., None])[..., 0], dtype=float)
    gain = 2 * np.sum(score * forced, axis=1) / max(1.0, fit.misfit)
    return _TrialModes(frequencies, gain, forced, -np.einsum("cf,cfk->ck", forced, regression))


def _own_information(mode: ComplexMatrix, weight: ComplexMatrix, g: ComplexMatrix, square: Vector) -> Matrix:
    """(trials, floors, floors) JᵀJ of the coefficients of each trial mode."""
    floors = len(weight)
    pairs = np.eye(floors)[..., None] * squared(weight) - (
        weight.conj()[:, None] * g[1:, None] * g[None, 1:].conj() * weight[None] / square
    )
    return np.asarray((squared(mode) @ pairs.real.reshape(floors**2, -1).T).reshape(-1, floors, floors))
