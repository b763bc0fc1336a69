"""The restoring force of a calibrated frame with its standard deviation."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.hypotheses import Choice
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design, superstructure
from core.estimators.frame.reconstruction import (
    LinearModel,
    force_history,
    force_spectrum,
    line_weights,
    without_free_vibration,
)
from core.estimators.frame.shape_error import local_mean_square, shape_error
from core.estimators.result import ErrorSpectrum

AVERAGED = 9
"""Lines over which the force's error is averaged. A choice."""
MOVING = 15.0
"""Hz, above which the force moves too little for the parameters' uncertainty to matter. A choice."""
COUNTED = 0.999
"""Share of the force's variance by the parameters; further directions of their uncertainty are left out. A choice."""
BEYOND = 1.5
"""Mean square of the building's distance over that of a rival as likely as the chosen hypothesis.

It is above 1 because the building may lie beyond the rival. Chosen on even seeds of tests/support/band_coverage.py."""


@dataclass(frozen=True, slots=True, eq=False)
class Reconstruction:
    """The restoring force with its errors."""

    force: Vector
    """(n,) N."""
    rigid: Vector
    """(n,) N, of that: the whole building moving as the base slab."""
    std: Vector
    """(n,) N, standard deviation of the force."""
    noise_std: Vector
    """(n,) N, of that: without errors of shape, and with the noise that the quiet part of the record shows."""
    error: ErrorSpectrum
    """N²/Hz, `noise_std` by frequency; what the parameters' uncertainty does, as patterns."""
    systematic: Matrix
    """(p, n) N, effect on the force of one standard deviation of each parameter direction and of the shape."""


def reconstructed(
    lines: Lines, design: Design, calibration: Calibration, base_mass: float, share: float | None = None
) -> Reconstruction:
    """The force F = -Σ m_i a_i over all levels, by the posterior mean of every level's acceleration.

    The standard deviation holds the channels' noise, the motion of the floors without a sensor, and the uncertainty
    of the calibrated parameters; where the model does not hold they grow with its misfit.

    Args:
        lines: all of the record's spectrum, from zero to half the rate.
        design: of the building.
        calibration: of the superstructure.
        base_mass: kg.
        share: LeftOut.share; where the record shows it, errors of shape replace unmodelled motion.
    """
    model = LinearModel(lines, design, calibration, calibration.parameters, calibration.structure, base_mass)
    weights, spectra = (
        line_weights(model),
        without_free_vibration(lines, design, calibration.structure, model.parameters),
    )
    base = np.einsum("lc,cl->l", weights.base, spectra)
    total = base_mass + design.floor_mass.sum()
    force = force_spectrum(model, weights, spectra)
    shape_history = shape_error(model, spectra, force, share)
    shapes = local_mean_square(shape_history[None], lines.rate)
    motion = _stationary(weights.motion, lines.samples) * _envelope(lines)
    noise = _stationary(weights.noise, lines.samples)
    patterns = np.sqrt(max(1.0, calibration.chi_square)) * _by_parameters(model)
    unknown = np.sum(patterns**2, axis=0)
    unmodelled = shapes if share is not None and calibration.hypothesis.is_random else np.maximum(motion, shapes)
    variance = _excess_noise(lines, calibration) * noise + unmodelled + unknown
    return Reconstruction(
        np.asarray(np.fft.irfft(force, lines.samples)),
        -total * np.fft.irfft(base, lines.samples),
        np.sqrt(variance),
        np.sqrt(noise + motion + unknown),
        _error(weights.noise + weights.motion, patterns, lines),
        np.vstack([patterns, shape_history]),
    )


def _excess_noise(lines: Lines, calibration: Calibration) -> float:
    """Power of the noise by the calibration's residual over that by the quiet part of the record.

    That part is short; where noise explains the residual, thousands of lines determine the noise better.
    """
    if calibration.hypothesis.is_random:
        return 1.0
    return calibration.chi_square * float(calibration.noise[0] / lines.noise[0])


def _error(power: Vector, patterns: Matrix, lines: Lines) -> ErrorSpectrum:
    """From the mean square at every line of what has no pattern, and from the patterns.

    A superstructure that is none of the model's class errs in other shapes than the parameters' uncertainty does, if
    about as much: half of its power is given by frequency alone.
    """
    every = power + np.sum(np.abs(np.fft.rfft(patterns, axis=1)) ** 2, axis=0) / 2
    density = 2 * ndimage.uniform_filter1d(every, AVERAGED, mode="nearest") / (lines.samples * lines.rate)
    return ErrorSpectrum(lines.angular / (2 * np.pi), density, patterns / np.sqrt(2), is_shrunk=True)


def _by_parameters(model: LinearModel) -> Matrix:
    """(directions, n) N, effect on the force of one standard deviation of the parameters, to first order.

    Only those principal directions of the covariance count that move the force, judged by a few lines.
    """
    lines, calibration = model.lines, model.calibration
    moving = np.flatnonzero(lines.angular < 2 * np.pi * MOVING)
    slow = replace(model, lines=lines.chosen(moving))
    free = calibration.hypothesis.free
    values, directions = np.linalg.eigh(calibration.covariance[np.ix_(free, free)])
    moves = np.zeros((free.size, calibration.parameters.size))
    moves[:, free] = (np.sqrt(np.maximum(values, 0.0)) * directions).T
    few = replace(model, lines=slow.lines.every(max(1, moving.size // 400)))
    strength = np.sum(np.abs(_changes(few, moves)) ** 2, axis=1)
    order = np.argsort(strength)[::-1]
    counted = order[: 1 + int(np.searchsorted(np.cumsum(strength[order]), COUNTED * strength.sum()))]
    spectra = np.zeros((counted.size, lines.angular.size), dtype=complex)
    spectra[:, moving] = _changes(slow, moves[counted])
    return np.asarray(np.fft.irfft(spectra, lines.samples, axis=1))


def _changes(model: LinearModel, moves: Matrix) -> ComplexMatrix:
    """(moves, lines) change of the force's spectrum by each move of the parameters.

    Half the difference of the moves forwards and backwards: the sign of a principal direction has no meaning, and some
    moves are too large for one side to be like the other.
    """

    def force(parameters: Vector) -> ComplexVector:
        structure = superstructure(parameters, model.design)
        moved = replace(model, parameters=parameters, structure=structure)
        spectra = without_free_vibration(model.lines, model.design, structure, parameters)
        return force_spectrum(moved, line_weights(moved), spectra)

    here = model.parameters
    return np.array([(force(here + move) - force(here - move)) / 2 for move in moves])


def _stationary(variance: Vector, samples: int) -> float:
    """Variance in time of a real history from that at every line of its one-sided spectrum."""
    return float((2 * variance.sum() - variance[0]) / samples**2)


def _envelope(lines: Lines) -> Vector:
    """(n,) mean square of the channels about each instant, over that of the record."""
    histories = np.fft.irfft(lines.spectra, lines.samples, axis=1)
    strength = local_mean_square(histories, lines.rate)
    return np.asarray(strength / strength.mean())


def rival_errors(lines: Lines, design: Design, choice: Choice, base_mass: float, chosen: Reconstruction) -> Matrix:
    """(rivals, n) N, one standard deviation of the force towards each rival of the chosen hypothesis.

    Args:
        lines: all of the record's spectrum.
        design: of the building.
        choice: the hypothesis chosen, and its rivals.
        base_mass: kg.
        chosen: by the one chosen.
    """
    errors = np.zeros((len(choice.rivals), lines.samples))
    for row, rival in zip(errors, choice.rivals, strict=True):
        calibration = rival.calibration
        model = LinearModel(lines, design, calibration, calibration.parameters, calibration.structure, base_mass)
        row[:] = np.sqrt(BEYOND * rival.weight) * (force_history(model) - chosen.force)
    return errors
