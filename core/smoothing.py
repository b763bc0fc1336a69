"""The restoring force and its uncertainty, all floors estimated together from those measured."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage, signal

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Matrix, Vector
from core.calibration import Calibration
from core.evaluation import DYNAMIC_SHARE, static_flexibility, transient_columns
from core.frame import heights
from core.spectral_lines import Lines
from core.superstructure_model import Design, Superstructure, superstructure

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
    parameters = calibration.parameters
    weights = _weights(lines, design, calibration, calibration.structure, parameters, base_mass)
    force = _force(lines, design, weights, calibration.structure, parameters)
    base = np.einsum("lc,cl->l", weights.base, without_transients(lines, design, calibration.structure, parameters))
    total = base_mass + design.floor_mass.sum()
    history = _history(force, lines.samples)
    variance = _stationary(weights.noise, lines.samples) + _stationary(weights.motion, lines.samples) * _envelope(lines)
    variance += max(1.0, calibration.chi_square) * _parameter_variance(lines, design, calibration, base_mass)
    return Smoothed(history, -total * _history(base, lines.samples), np.sqrt(variance))


def _weights(
    lines: Lines,
    design: Design,
    calibration: Calibration,
    structure: Superstructure,
    parameters: Vector,
    base_mass: float,
) -> _Weights:
    response, inertia = _responses(lines, design, structure, parameters, base_mass)
    variance = _input_variances(lines, calibration, design.layout.floors)
    weighted = response * variance
    covariance = _covariance(lines, design, calibration, response, weighted)
    local, carried = _local(lines, calibration), structure.mass @ static_flexibility(design)
    crossed = np.einsum("il,cil->lc", inertia, weighted.conj())
    crossed[:, 1:] -= local[:, None] * carried[design.measured]
    prior = np.einsum("il,il,il->l", inertia, variance, inertia.conj()).real + local * (carried @ structure.mass)
    inverse = np.linalg.inv(covariance)
    force = np.einsum("lc,lcd->ld", crossed, inverse)
    base = np.einsum("cl,lcd->ld", weighted[:, 0].conj(), inverse)
    noise = np.einsum("lc,c->l", np.abs(force) ** 2, lines.noise)
    posterior = prior - np.einsum("lc,lc->l", force, crossed.conj()).real
    return _Weights(force, base, noise, np.maximum(posterior - noise, 0.0))


def _responses(
    lines: Lines, design: Design, structure: Superstructure, parameters: Vector, base_mass: float
) -> tuple[ComplexTensor, ComplexMatrix]:
    """(channels, inputs, lines) and (inputs, lines) N s²/m: what the base slab's acceleration, its rocking and every
    floor's own acceleration do at the channels, and in the force."""
    layout, w = design.layout, lines.angular
    α, η, β = structure.damping
    compliance = w**2 / (structure.squared[:, None] * (1 + 1j * (w * α + η)) - w**2 + 1j * w * β)
    gain = parameters[layout.gains] - np.median(parameters[layout.gains])
    delay = parameters[layout.delays] - np.median(parameters[layout.delays])
    sensor = np.exp(gain[:, None] - 1j * delay[:, None] * w)
    rigid = np.vstack([np.ones(layout.floors), heights(layout.floors), np.zeros((layout.floors, layout.floors))]).T
    response = np.zeros((layout.channels, rigid.shape[1], w.size), dtype=complex)
    response[0, 0] = 1.0
    seen = structure.shapes[design.measured][:, :, None] * structure.inputs
    response[1:] = rigid[design.measured][:, :, None] + np.einsum("fmi,ml->fil", seen, compliance)
    response *= sensor[:, None]
    carried = (structure.mass @ structure.shapes)[:, None] * structure.inputs
    inertia = np.asarray(-(structure.mass @ rigid)[:, None] - carried.T @ compliance, dtype=complex)
    inertia[0] -= base_mass
    return response, inertia


def _covariance(
    lines: Lines, design: Design, calibration: Calibration, response: ComplexTensor, weighted: ComplexTensor
) -> ComplexTensor:
    """(lines, channels, channels) of the channels' spectra."""
    covariance = np.einsum("cil,dil->lcd", weighted, response.conj(), optimize=True)
    flexibility = static_flexibility(design)[np.ix_(design.measured, design.measured)]
    covariance[:, 1:, 1:] += _local(lines, calibration)[:, None, None] * flexibility
    return np.asarray(covariance + np.diag(lines.noise))


def channel_covariance(lines: Lines, design: Design, calibration: Calibration) -> ComplexTensor:
    """(lines, channels, channels) of the channels' spectra, as calibrated."""
    response, _ = _responses(lines, design, calibration.structure, calibration.parameters, 0.0)
    variance = _input_variances(lines, calibration, design.layout.floors)
    return _covariance(lines, design, calibration, response, response * variance)


def _local(lines: Lines, calibration: Calibration) -> Vector:
    """(lines,) variance of the roof's unmodelled motion that does not act through the structure."""
    return np.asarray((1 - DYNAMIC_SHARE) * calibration.variances.floors[lines.band])


def _input_variances(lines: Lines, calibration: Calibration, floors: int) -> Matrix:
    """(2 + floors, lines) of the base slab's acceleration, its rocking, and single floors' accelerations."""
    power = ndimage.uniform_filter1d(np.abs(lines.spectra[0]) ** 2, NEIGHBOURS, mode="nearest")
    base = np.maximum(power - lines.noise[0], 1e-3 * power)
    band, variances = lines.band, calibration.variances
    single = DYNAMIC_SHARE * variances.floors[band]
    return np.vstack([base, variances.rocking[band], np.tile(single, (floors, 1))])


def without_transients(lines: Lines, design: Design, structure: Superstructure, parameters: Vector) -> ComplexMatrix:
    """(channels, lines) spectra less the modes' free vibration."""
    if lines.at_rest:
        return lines.spectra
    layout = design.layout
    columns = transient_columns(structure, lines, design.measured)
    free = np.tensordot(parameters[layout.transients], columns, 1)
    sensor = np.exp(parameters[layout.gains][1:, None] - 1j * parameters[layout.delays][1:, None] * lines.angular)
    left = lines.spectra.copy()
    left[1:] -= sensor * free
    return left


def _force(
    lines: Lines, design: Design, weights: _Weights, structure: Superstructure, parameters: Vector
) -> ComplexVector:
    """(lines,) spectrum of the force."""
    spectra = without_transients(lines, design, structure, parameters)
    force = np.einsum("lc,cl->l", weights.force, spectra)
    if not lines.at_rest:
        columns = transient_columns(structure, lines, np.arange(design.layout.floors))
        free = np.tensordot(parameters[design.layout.transients], columns, 1)
        force = force - structure.mass @ free
    return np.asarray(force)


def _parameter_variance(lines: Lines, design: Design, calibration: Calibration, base_mass: float) -> Vector:
    """(n,) N², of the force by the parameters' uncertainty, to first order.

    Of the covariance's principal directions only those count that move the force; which, a few lines tell.
    """
    moving = lines.angular < 2 * np.pi * MOVING
    slow = replace(lines, angular=lines.angular[moving], spectra=lines.spectra[:, moving], band=lines.band[moving])
    free = calibration.hypothesis.free
    values, directions = np.linalg.eigh(calibration.covariance[np.ix_(free, free)])
    moves = np.zeros((free.size, calibration.parameters.size))
    moves[:, free] = (np.sqrt(np.maximum(values, 0.0)) * directions).T
    few = slow.every(max(1, slow.angular.size // 400))
    changes = _changes(few, design, calibration, base_mass, moves)
    strength = np.sum(np.abs(changes) ** 2, axis=1)
    order = np.argsort(strength)[::-1]
    counted = order[: 1 + int(np.searchsorted(np.cumsum(strength[order]), COUNTED * strength.sum()))]
    spectra = np.zeros((counted.size, lines.angular.size), dtype=complex)
    spectra[:, moving] = _changes(slow, design, calibration, base_mass, moves[counted])
    return np.asarray(np.sum(np.fft.irfft(spectra, lines.samples, axis=1) ** 2, axis=0))


def _changes(lines: Lines, design: Design, calibration: Calibration, base_mass: float, moves: Matrix) -> ComplexMatrix:
    """(moves, lines) by how much each move of the parameters changes the force's spectrum."""

    def force(parameters: Vector) -> ComplexVector:
        structure = superstructure(parameters, design)
        weights = _weights(lines, design, calibration, structure, parameters, base_mass)
        return _force(lines, design, weights, structure, parameters)

    here = force(calibration.parameters)
    return np.array([force(calibration.parameters + move) - here for move in moves])


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
