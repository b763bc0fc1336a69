"""The restoring force and its uncertainty, all floors estimated together from those measured."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage, signal

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Matrix, Vector
from core.calibration import Calibration
from core.evaluation import sensor_errors
from core.free_vibration import floors_free_vibration
from core.line_misfit import Responses, responses
from core.spectral_lines import Lines
from core.superstructure_model import Design, Superstructure, rigid_motion, superstructure
from core.unmodelled_motion import DYNAMIC_SHARE, static_flexibility

NEIGHBOURS = 21
"""Lines over which the spectrum of the base slab's motion is averaged."""
MOVING = 15.0
"""Hz, above which the force moves too little for the parameters' uncertainty to matter."""
COUNTED = 0.999
"""Of the force's variance by the parameters: further directions of their uncertainty are left out."""
ENVELOPE = 2.0
"""s, over which the motion's strength is judged."""


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """What the floors' estimate says of the isolation layer."""

    force: Vector
    """(n,) N."""
    rigid: Vector
    """(n,) N, of that: the whole building moving as the base slab."""
    std: Vector
    """(n,) N, standard deviation of the force."""


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """What the estimate is linear by: lines, building, and one choice of parameters."""

    lines: Lines
    design: Design
    calibration: Calibration
    parameters: Vector
    structure: Superstructure
    base_mass: float

    @property
    def inputs(self) -> int:
        """How many move: the base slab; beyond what the parameters explain also its rocking and every floor."""
        return 2 + self.design.layout.floors if self.calibration.hypothesis.is_random else 1


@dataclass(frozen=True, slots=True, eq=False)
class _Weights:
    """The linear estimate at every line."""

    force: ComplexMatrix
    """(lines, channels) kg, of the force."""
    base: ComplexMatrix
    """(lines, channels) of the base slab's acceleration."""
    noise: Vector
    """(lines,) N², variance of the force by the channels' noise."""
    motion: Vector
    """(lines,) N², variance of the force by motions that the channels do not tell."""


def smoothed(lines: Lines, design: Design, calibration: Calibration, base_mass: float) -> Smoothed:
    """The force F = -Σ m_i a_i over all levels, by the posterior mean of every level's acceleration.

    The standard deviation holds the channels' noise, the motion of the floors without a sensor, and the uncertainty
    of the calibrated parameters; where the model does not hold they grow with its misfit.

    Args:
        lines: all of the record's spectrum, from zero to half the rate.
        design: of the building.
        calibration: of the superstructure.
        base_mass: kg.
    """
    model = _Model(lines, design, calibration, calibration.parameters, calibration.structure, base_mass)
    weights, spectra = _weights(model), without_free_vibration(lines, design, calibration.structure, model.parameters)
    base = np.einsum("lc,cl->l", weights.base, spectra)
    total = base_mass + design.floor_mass.sum()
    variance = _stationary(weights.noise, lines.samples) + _stationary(weights.motion, lines.samples) * _envelope(lines)
    variance += max(1.0, calibration.chi_square) * _parameter_variance(model)
    force = _history(_force(model, weights, spectra), lines.samples)
    return Smoothed(force, -total * _history(base, lines.samples), np.sqrt(variance))


def channel_covariance(lines: Lines, design: Design, calibration: Calibration) -> ComplexTensor:
    """(lines, channels, channels) of the channels' spectra, as calibrated."""
    model = _Model(lines, design, calibration, calibration.parameters, calibration.structure, 0.0)
    acting = _responses(model).acting
    return _covariance(model, acting, acting * _input_variances(model)[:, None])


def without_free_vibration(
    lines: Lines, design: Design, structure: Superstructure, parameters: Vector
) -> ComplexMatrix:
    """(channels, lines) spectra less the modes' free vibration, as the sensors see it."""
    layout, spectra = design.layout, lines.spectra.copy()
    free = floors_free_vibration(structure, lines, design.measured, parameters[layout.transients])
    spectra[1:] -= sensor_errors(parameters, layout, lines.angular)[1:] * free
    return spectra


def _weights(model: _Model) -> _Weights:
    lines, design, structure = model.lines, model.design, model.structure
    given, variance = _responses(model), _input_variances(model)
    weighted, inertia = given.acting * variance[:, None], _inertia(model, given)
    local, carried = _local(model), structure.mass @ static_flexibility(design)
    crossed = np.einsum("il,icl->lc", inertia, weighted.conj())
    crossed[:, 1:] -= local[:, None] * carried[design.measured]
    prior = np.sum(np.abs(inertia) ** 2 * variance, axis=0) + local * (carried @ structure.mass)
    inverse = np.linalg.inv(_covariance(model, given.acting, weighted))
    force = np.einsum("lc,lcd->ld", crossed, inverse)
    base = np.einsum("cl,lcd->ld", weighted[0].conj(), inverse)
    noise = np.abs(force) ** 2 @ lines.noise
    posterior = prior - np.einsum("lc,lc->l", force, crossed.conj()).real
    return _Weights(force, base, noise, np.maximum(posterior - noise, 0.0))


def _responses(model: _Model) -> Responses:
    """Of the channels to all that moves.

    What gains and delays have in common is no sensor's error: it stays in the motion.
    """
    layout, lines = model.design.layout, model.lines
    sensors = sensor_errors(model.parameters, layout, lines.angular) / _common(model)
    return responses(model.structure, lines.angular, model.design.measured, sensors, model.inputs)


def _common(model: _Model) -> ComplexVector:
    """(lines,) what gains and delays have in common."""
    layout = model.design.layout
    gain, delay = (np.median(model.parameters[which]) for which in (layout.gains, layout.delays))
    return np.asarray(np.exp(gain - 1j * delay * model.lines.angular))


def _inertia(model: _Model, given: Responses) -> ComplexMatrix:
    """(inputs, lines) kg, what the inputs do in the force."""
    structure = model.structure
    rigid = rigid_motion(structure.mass.size)[: model.inputs] @ structure.mass
    rigid[0] += model.base_mass
    carried = (structure.mass @ structure.shapes)[:, None] * structure.inputs[:, : model.inputs]
    return np.asarray(-rigid[:, None] - carried.T @ (model.lines.angular**2 * given.compliance))


def _covariance(model: _Model, acting: ComplexTensor, weighted: ComplexTensor) -> ComplexTensor:
    """(lines, channels, channels) of the channels' spectra."""
    measured = model.design.measured
    covariance = np.einsum("icl,idl->lcd", weighted, acting.conj(), optimize=True)
    flexibility = static_flexibility(model.design)[np.ix_(measured, measured)]
    covariance[:, 1:, 1:] += _local(model)[:, None, None] * flexibility
    return np.asarray(covariance + np.diag(model.lines.noise))


def _local(model: _Model) -> Vector:
    """(lines,) variance of the roof's unmodelled motion that does not act through the structure."""
    return np.asarray((1 - DYNAMIC_SHARE) * model.calibration.variances.floors[model.lines.band])


def _input_variances(model: _Model) -> Matrix:
    """(inputs, lines) of the base slab's acceleration, its rocking, and single floors' accelerations."""
    lines = model.lines
    power = ndimage.uniform_filter1d(np.abs(lines.spectra[0]) ** 2, NEIGHBOURS, mode="nearest")
    base = np.maximum(power - lines.noise[0], 1e-3 * power)
    rocking, floors = model.calibration.variances.at(lines)
    return np.vstack([base, rocking, np.tile(floors, (model.design.layout.floors, 1))])[: model.inputs]


def _force(model: _Model, weights: _Weights, spectra: ComplexMatrix) -> ComplexVector:
    """(lines,) spectrum of the force."""
    layout, structure = model.design.layout, model.structure
    every, amplitudes = np.arange(layout.floors), model.parameters[layout.transients]
    free = _common(model) * floors_free_vibration(structure, model.lines, every, amplitudes)
    return np.asarray(np.einsum("lc,cl->l", weights.force, spectra) - structure.mass @ free)


def _parameter_variance(model: _Model) -> Vector:
    """(n,) N², of the force by the parameters' uncertainty, to first order.

    Of the covariance's principal directions only those count that move the force; which, a few lines tell.
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
    return np.asarray(np.sum(np.fft.irfft(spectra, lines.samples, axis=1) ** 2, axis=0))


def _changes(model: _Model, moves: Matrix) -> ComplexMatrix:
    """(moves, lines) by how much each move of the parameters changes the force's spectrum."""

    def force(parameters: Vector) -> ComplexVector:
        structure = superstructure(parameters, model.design)
        moved = replace(model, parameters=parameters, structure=structure)
        spectra = without_free_vibration(model.lines, model.design, structure, parameters)
        return _force(moved, _weights(moved), spectra)

    here = force(model.parameters)
    return np.array([force(model.parameters + move) - here for move in moves])


def _stationary(variance: Vector, samples: int) -> float:
    """Variance in time of what has the given one at every line of a real history's one-sided spectrum."""
    return float((2 * variance.sum() - variance[0]) / samples**2)


def _envelope(lines: Lines) -> Vector:
    """(n,) mean square of the channels about each instant, over that of the record."""
    histories = np.fft.irfft(lines.spectra, lines.samples, axis=1)
    window = signal.windows.hann(max(3, round(ENVELOPE * lines.rate)))
    strength = signal.fftconvolve((histories**2).sum(axis=0), window / window.sum(), mode="same")
    strength = np.maximum(strength, 0.0)
    return np.asarray(strength / strength.mean())


def _history(spectrum: ComplexVector, samples: int) -> Vector:
    return np.asarray(np.fft.irfft(spectrum, samples))
