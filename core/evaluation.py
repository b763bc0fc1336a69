"""What does a choice of parameters cost, and which way is down?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, Indices, Matrix, Vector
from core.frame import heights
from core.line_misfit import (
    Responses,
    Whitened,
    by_noise_alone,
    determinant_descent,
    mass_derivatives,
    projected,
    responses,
    sensor_derivatives,
    structural_derivatives,
    variance_at,
    whitened_by,
)
from core.spectral_lines import Lines
from core.superstructure_model import Design, Superstructure, free_vibration, superstructure

DYNAMIC_SHARE = 0.2
"""Of the floors' random motion that acts through the structure; the rest is seen at the sensors alone."""
NUDGE = 1e-5
"""Of a logarithm, for a difference quotient."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """Which parameters a calibration is free to choose, and what is believed of them before."""

    name: str
    mean: Vector
    """(size,)"""
    std: Vector
    """(size,) 0 where a parameter is held."""
    is_random: bool
    """Whether the base slab rocks and the floors move beyond what the model says."""

    @property
    def free(self) -> Indices:
        """Parameters that are not held."""
        return np.flatnonzero(self.std > 0)

    def penalty(self, parameters: Vector) -> float:
        """Of the prior, in units of a negative log likelihood."""
        free = self.free
        return 0.5 * float(np.sum(((parameters - self.mean)[free] / self.std[free]) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class Variances:
    """Of the motions that no parameter explains, by frequency band."""

    rocking: Vector
    """(bands,) of the base slab's rocking, as acceleration at the roof."""
    floors: Vector
    """(bands,) of accelerations at the floors."""


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """Of a calibration at one choice of parameters."""

    structure: Superstructure
    cost: float
    """Negative log posterior probability, up to a constant."""
    descent: Vector
    """(size,) the cost's negative gradient; 0 where it was not asked for."""
    normal: Matrix
    """(size, size) Gauss and Newton's approximation of its second derivatives."""
    steps: Matrix
    """(bands, 5) numerators and denominators of both variances' steps; the misfit."""
    frozen: ComplexMatrix
    """(channels, lines) h."""


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """The lines as the parameters explain them."""

    structure: Superstructure
    given: Responses
    ringing: ComplexMatrix
    """(channels, lines) the free vibration, in units of noise."""
    whitened: Whitened
    residual: ComplexMatrix
    """(channels, lines) white, without its part along h."""
    inputs: ComplexMatrix
    """(2 + floors, lines) of base slab, rocking, single floors."""
    unmodelled: ComplexTensor
    """(1 + floors, channels, lines) what rocking and single floors do, white; (0, channels, lines) if nothing is."""
    steps: Matrix
    """(bands, 4) as in Evaluation."""


def evaluated(
    lines: Lines,
    design: Design,
    hypothesis: Hypothesis,
    parameters: Vector,
    variances: Variances,
    frozen: ComplexMatrix | None,
    *,
    is_derived: bool = True,
) -> Evaluation:
    """Cost at the parameters, and its derivatives where they are wanted.

    Args:
        lines: of the record.
        design: what is believed of the building.
        hypothesis: what is free.
        parameters: (size,) as core.superstructure_model.Layout says.
        variances: of unmodelled motion.
        frozen: (channels, lines) the h at which the determinant along h is taken; None for that of the parameters.
        is_derived: whether the derivatives are wanted.
    """
    size = design.layout.size
    descent, normal = np.zeros(size), np.zeros((size, size))
    fit = _fit(lines, design, hypothesis, parameters, variances)
    by_band = np.bincount(lines.band, np.sum(np.abs(fit.residual) ** 2, axis=0), minlength=variances.rocking.size)
    cost = float(by_band.sum()) + hypothesis.penalty(parameters)
    if hypothesis.is_random:
        along = fit.given.base if frozen is None else frozen
        cost += fit.whitened.log_determinant + _log_power(fit.whitened, along)
        if is_derived:
            descent[: design.layout.structural] = _by_determinant(lines, design, variances, fit)
    if is_derived:
        derivatives = _derivatives(lines, design, hypothesis, parameters, fit)
        free = np.flatnonzero(hypothesis.std[: len(derivatives)] > 0)
        flat = fit.whitened.of(derivatives[free]).reshape(free.size, -1).view(float)
        descent[free] += 2 * flat @ np.ascontiguousarray(fit.residual).reshape(-1).view(float)
        normal[np.ix_(free, free)] = 2 * flat @ flat.T
    free = hypothesis.free
    descent[free] -= (parameters - hypothesis.mean)[free] / hypothesis.std[free] ** 2
    normal[free, free] += 1 / hypothesis.std[free] ** 2
    return Evaluation(fit.structure, cost, descent, normal, np.column_stack([fit.steps, by_band]), fit.given.base)


def _fit(lines: Lines, design: Design, hypothesis: Hypothesis, parameters: Vector, variances: Variances) -> _Fit:
    layout, structure = design.layout, superstructure(parameters, design)
    scale = 1 / np.sqrt(lines.noise)[:, None]
    clocks = np.exp(-1j * parameters[layout.delays][:, None] * lines.angular)
    sensors = scale * np.exp(parameters[layout.gains])[:, None] * clocks
    given = responses(structure, lines.angular, design.measured, heights(layout.floors), np.asarray(sensors))
    ringing = sensors * _transient(lines, design, structure, parameters)
    inputs = np.zeros((2 + layout.floors, lines.angular.size), dtype=complex)
    unmodelled, steps = np.zeros((0, *sensors.shape), dtype=complex), np.zeros((variances.rocking.size, 4))
    if not hypothesis.is_random:
        whitened = by_noise_alone(given.base)
        residual, inputs[0] = projected(whitened, scale * lines.spectra - ringing)
        return _Fit(structure, given, ringing, whitened, residual, inputs, unmodelled, steps)
    local, weights = scale * local_covariance(design) * scale.T, _weights(lines, variances)
    variance = variance_at(given, weights[0], weights[1] / DYNAMIC_SHARE, local, DYNAMIC_SHARE)
    whitened = whitened_by(variance, given.base)
    residual, inputs[0] = projected(whitened, scale * lines.spectra - ringing)
    unmodelled = whitened.of(np.concatenate([given.rocking[None], given.floors]))
    met = np.einsum("icl,cl->il", unmodelled.conj(), residual)
    inputs[1], inputs[2:] = weights[0] * met[0], weights[1] * met[1:]
    steps = _variance_steps(lines, local, whitened, unmodelled, met, residual)
    return _Fit(structure, given, ringing, whitened, residual, inputs, unmodelled, steps)


def _by_determinant(lines: Lines, design: Design, variances: Variances, fit: _Fit) -> Vector:
    """(structural,) by how much a parameter lowers the determinant."""
    weights = _weights(lines, variances)[[0] + [1] * design.layout.floors]
    inverse = fit.whitened.back(fit.unmodelled)
    return determinant_descent(fit.structure, fit.given, lines.angular, design.measured, inverse, weights)


def _derivatives(lines: Lines, design: Design, hypothesis: Hypothesis, parameters: Vector, fit: _Fit) -> ComplexTensor:
    """(parameters, channels, lines) of the channels, in units of noise; without the transients of a record at rest."""
    layout, given, inputs = design.layout, fit.given, fit.inputs
    where = (fit.structure, given, lines.angular, design.measured, heights(layout.floors), inputs)
    derivatives = structural_derivatives(*where)
    if np.any(hypothesis.std[layout.masses]):
        derivatives[layout.masses] = mass_derivatives(*where)
    modelled = given.base * inputs[0] + given.rocking * inputs[1] + np.einsum("il,icl->cl", inputs[2:], given.floors)
    derivatives = np.concatenate([derivatives, sensor_derivatives(modelled + fit.ringing, lines.angular)])
    if lines.at_rest:
        return derivatives
    return _with_transients(derivatives, lines, design, fit.structure, parameters, given.sensors)


def _weights(lines: Lines, variances: Variances) -> Matrix:
    """(2, lines) variances of the rocking, and of any floor's own motion through the structure."""
    return np.vstack([variances.rocking[lines.band], DYNAMIC_SHARE * variances.floors[lines.band]])


def _log_power(whitened: Whitened, along: ComplexMatrix) -> float:
    """Σ log hᴴ V⁻¹ h."""
    white = whitened.without_projection(along[None])[0]
    return float(np.sum(np.log(np.sum(np.abs(white) ** 2, axis=0))))


def _variance_steps(
    lines: Lines, local: Matrix, whitened: Whitened, white: ComplexTensor, met: ComplexMatrix, residual: ComplexMatrix
) -> Matrix:
    """(bands, 4) numerators and denominators of the multiplicative steps: of the rocking, of the floors' own motion."""
    factor = np.linalg.cholesky(local[1:, 1:])
    seen_alone = np.zeros((len(factor), len(factor) + 1, lines.angular.size), dtype=complex)
    seen_alone[:, 1:] = factor.T[:, :, None]
    seen_alone = whitened.of(seen_alone)
    met_alone = np.einsum("icl,cl->il", seen_alone.conj(), residual)
    share = DYNAMIC_SHARE
    power, size = np.sum(np.abs(white) ** 2, axis=1), np.sum(np.abs(seen_alone) ** 2, axis=1)
    columns = [
        np.abs(met[0]) ** 2,
        power[0],
        share * np.sum(np.abs(met[1:]) ** 2, axis=0) + (1 - share) * np.sum(np.abs(met_alone) ** 2, axis=0),
        share * power[1:].sum(axis=0) + (1 - share) * size.sum(axis=0),
    ]
    return np.column_stack([np.bincount(lines.band, column, minlength=lines.band.max() + 1) for column in columns])


def local_covariance(design: Design) -> Matrix:
    """(channels, channels) of a motion seen at sensors alone: the storeys' static flexibility, so that between sensors
    it is interpolated as Guyan (1965) would."""
    flexibility = static_flexibility(design)
    covariance = np.zeros((design.measured.size + 1,) * 2)
    covariance[1:, 1:] = flexibility[np.ix_(design.measured, design.measured)]
    return covariance


def static_flexibility(design: Design) -> Matrix:
    """(floors, floors) of the storeys as designed, 1 at the roof."""
    cumulated = np.cumsum(1 / design.storey_stiffness) * design.storey_stiffness.sum()
    flexibility = np.minimum.outer(cumulated, cumulated)
    return np.asarray(flexibility / flexibility[-1, -1])


def _transient(lines: Lines, design: Design, structure: Superstructure, parameters: Vector) -> ComplexMatrix:
    """(channels, lines) free vibration from the record's start on, as sensors without error see it."""
    whole = np.zeros((design.measured.size + 1, lines.angular.size), dtype=complex)
    if not lines.at_rest:
        columns = transient_columns(structure, lines, design.measured)
        whole[1:] = np.tensordot(parameters[design.layout.transients], columns, 1)
    return whole


def _with_transients(
    derivatives: ComplexTensor,
    lines: Lines,
    design: Design,
    structure: Superstructure,
    parameters: Vector,
    sensors: ComplexMatrix,
) -> ComplexTensor:
    """Derivatives by the free vibration's amplitudes too, and what it adds to those by the structure (differences)."""
    here = _transient(lines, design, structure, parameters)
    for k in range(design.layout.structural):
        nudged = parameters.copy()
        nudged[k] += NUDGE
        there = _transient(lines, design, superstructure(nudged, design), nudged)
        derivatives[k] += sensors * (there - here) / NUDGE
    columns = transient_columns(structure, lines, design.measured)
    by_amplitude = np.zeros((len(columns), *sensors.shape), dtype=complex)
    by_amplitude[:, 1:] = columns * sensors[1:]
    return np.concatenate([derivatives, by_amplitude])


def transient_columns(structure: Superstructure, lines: Lines, floors: Indices) -> np.ndarray:
    """(2 modes, floors, lines) spectra at the given floors of each mode's free vibration."""
    vibration = free_vibration(structure, lines.angular, lines.samples, lines.rate)
    columns = structure.shapes[floors].T[:, None, :, None] * vibration[:, :, None, :]
    return columns.reshape(-1, floors.size, lines.angular.size)
