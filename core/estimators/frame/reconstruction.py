"""Linear estimate of every level's acceleration, and of the restoring force, from the measured channels."""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Matrix, Vector
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.evaluation import sensor_errors
from core.estimators.frame.free_vibration import floors_free_vibration
from core.estimators.frame.likelihood import DYNAMIC_SHARE, Responses, responses, static_flexibility
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design, Superstructure, rigid_motion
from core.signals.spectra import squared


@dataclass(frozen=True, slots=True, eq=False)
class LinearModel:
    """Lines, building and one choice of parameters, which make the estimate linear."""

    lines: Lines
    design: Design
    calibration: Calibration
    parameters: Vector
    structure: Superstructure
    base_mass: float

    @property
    def inputs(self) -> int:
        """Number of inputs: the base slab; with unmodelled motion also its rocking and every floor."""
        return 2 + self.design.layout.floors if self.calibration.hypothesis.is_random else 1


@dataclass(frozen=True, slots=True, eq=False)
class LineWeights:
    """The linear estimate at every line."""

    force: ComplexMatrix
    """(lines, channels) kg, of the force."""
    base: ComplexMatrix
    """(lines, channels) of the base slab's acceleration."""
    noise: Vector
    """(lines,) N², variance of the force by the channels' noise."""
    motion: Vector
    """(lines,) N², variance of the force by motions that the channels do not determine."""


def line_weights(model: LinearModel) -> LineWeights:
    """Posterior mean of the force and of the base slab's acceleration, and the force's variance."""
    if not model.calibration.hypothesis.is_random:
        return _base_driven_weights(model)
    lines, design, structure = model.lines, model.design, model.structure
    given, variance = channel_responses(model), _input_variances(model)
    weighted, inertia = given.acting * variance[:, None], _inertia(model, given)
    local, carried = _local(model), structure.mass @ static_flexibility(design)
    crossed = np.einsum("il,icl->lc", inertia, weighted.conj())
    crossed[:, 1:] -= local[:, None] * carried[design.measured]
    prior = np.sum(squared(inertia) * variance, axis=0) + local * (carried @ structure.mass)
    inverse = np.linalg.inv(_covariance(model, given.acting, weighted))
    force = np.einsum("lc,lcd->ld", crossed, inverse)
    base = np.einsum("cl,lcd->ld", weighted[0].conj(), inverse)
    noise = np.sum(squared(force) * lines.noise_at.T, axis=1)
    posterior = prior - np.einsum("lc,lc->l", force, crossed.conj()).real
    return LineWeights(force, base, noise, np.maximum(posterior - noise, 0.0))


def _base_driven_weights(model: LinearModel) -> LineWeights:
    """The same where nothing acts but the base slab: the covariance of the channels is the noise and one more rank."""
    lines, given = model.lines, channel_responses(model)
    weighed = given.base.conj() / lines.noise_at
    variance = 1 / (1 / lines.base_power + np.sum(given.base * weighed, axis=0).real)
    base, inertia = variance * weighed, _inertia(model, given)[0]
    force = inertia * base
    noise = np.sum(squared(force) * lines.noise_at, axis=0)
    return LineWeights(force.T, base.T, noise, np.maximum(squared(inertia) * variance - noise, 0.0))


def channel_covariance(lines: Lines, design: Design, calibration: Calibration) -> ComplexTensor:
    """(lines, channels, channels) of the channels' spectra, as calibrated."""
    model = LinearModel(lines, design, calibration, calibration.parameters, calibration.structure, 0.0)
    acting = channel_responses(model).acting
    return _covariance(model, acting, acting * _input_variances(model)[:, None])


def channel_responses(model: LinearModel) -> Responses:
    """Responses of the channels to all inputs.

    The common part of gains and delays is no sensor's error: it stays in the motion.
    """
    layout, lines, relative = model.design.layout, model.lines, model.parameters.copy()
    for which in (layout.gains, layout.delays):
        relative[which] -= _median(relative[which])
    sensors = sensor_errors(relative, layout, lines.angular)
    return responses(model.structure, lines.angular, model.design.measured, sensors, model.inputs)


def common_factor(model: LinearModel) -> ComplexVector:
    """(lines,) common factor of the channels' gains and delays."""
    layout = model.design.layout
    gain, delay = (_median(model.parameters[which]) for which in (layout.gains, layout.delays))
    return np.asarray(np.exp(gain - 1j * delay * model.lines.angular))


def _median(values: Vector) -> float:
    """The median, much faster for a few values than numpy's, which has checks for every kind of array."""
    ordered = np.sort(values)
    return float(ordered[(values.size - 1) // 2] + ordered[values.size // 2]) / 2


def _inertia(model: LinearModel, given: Responses) -> ComplexMatrix:
    """(inputs, lines) kg, force by unit inputs."""
    structure = model.structure
    rigid = rigid_motion(structure.mass.size)[: model.inputs] @ structure.mass
    rigid[0] += model.base_mass
    carried = (structure.mass @ structure.shapes)[:, None] * structure.inputs[:, : model.inputs]
    return np.asarray(-rigid[:, None] - carried.T @ (model.lines.angular**2 * given.compliance))


def _covariance(model: LinearModel, acting: ComplexTensor, weighted: ComplexTensor) -> ComplexTensor:
    """(lines, channels, channels) of the channels' spectra."""
    measured = model.design.measured
    covariance = np.einsum("icl,idl->lcd", weighted, acting.conj(), optimize=True)
    flexibility = static_flexibility(model.design)[np.ix_(measured, measured)]
    covariance[:, 1:, 1:] += _local(model)[:, None, None] * flexibility
    return np.asarray(covariance + model.lines.noise_at.T[:, :, None] * np.eye(len(model.lines.noise)))


def _local(model: LinearModel) -> Vector:
    """(lines,) variance of the roof's unmodelled motion that does not act through the structure."""
    return np.asarray((1 - DYNAMIC_SHARE) * model.calibration.variances.floors[model.lines.band])


def _input_variances(model: LinearModel) -> Matrix:
    """(inputs, lines) of the base slab's acceleration, its rocking, and single floors' accelerations."""
    lines = model.lines
    rocking, floors = model.calibration.variances.at(lines)
    return np.vstack([lines.base_power, rocking, np.tile(floors, (model.design.layout.floors, 1))])[: model.inputs]


def without_free_vibration(
    lines: Lines, design: Design, structure: Superstructure, parameters: Vector
) -> ComplexMatrix:
    """(channels, lines) spectra less the modes' free vibration, as the sensors see it."""
    layout, spectra = design.layout, lines.spectra.copy()
    if lines.at_rest:
        return spectra
    free = floors_free_vibration(structure, lines, design.measured, parameters[layout.transients])
    spectra[1:] -= sensor_errors(parameters, layout, lines.angular)[1:] * free
    return spectra


def force_history(model: LinearModel) -> Vector:
    """(n,) N, posterior mean of the force."""
    spectra = without_free_vibration(model.lines, model.design, model.structure, model.parameters)
    return np.asarray(np.fft.irfft(force_spectrum(model, line_weights(model), spectra), model.lines.samples))


def force_spectrum(model: LinearModel, weights: LineWeights, spectra: ComplexMatrix) -> ComplexVector:
    """(lines,) spectrum of the force."""
    layout, structure = model.design.layout, model.structure
    force = np.einsum("lc,cl->l", weights.force, spectra)
    if model.lines.at_rest:
        return np.asarray(force)
    every, amplitudes = np.arange(layout.floors), model.parameters[layout.transients]
    free = common_factor(model) * floors_free_vibration(structure, model.lines, every, amplitudes)
    return np.asarray(force - structure.mass @ free)
