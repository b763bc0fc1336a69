"""What does a choice of parameters cost, and which way is down?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Matrix, Vector
from core.estimators.frame.free_vibration import floors_free_vibration, free_vibration_changes, free_vibration_columns
from core.estimators.frame.line_derivatives import (
    determinant_descent,
    mass_derivatives,
    sensor_derivatives,
    structural_derivatives,
)
from core.estimators.frame.line_misfit import (
    Responses,
    Whitened,
    by_noise_alone,
    projected,
    responses,
    variance_at,
    whitened_by,
)
from core.estimators.frame.prior import Hypothesis
from core.estimators.frame.spectral_lines import Lines
from core.estimators.frame.superstructure_model import Design, Layout, Superstructure, superstructure
from core.estimators.frame.unmodelled_motion import DYNAMIC_SHARE, Variances, local_covariance


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What is to be found, and from what."""

    lines: Lines
    design: Design
    hypothesis: Hypothesis


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The lines as one choice of parameters explains them."""

    question: Question
    parameters: Vector
    variances: Variances
    structure: Superstructure
    cost: float
    """Negative log posterior probability, up to a constant."""
    misfit_by_band: Vector
    """(bands,)"""
    given: Responses
    ringing: ComplexMatrix
    """(channels, lines) the free vibration, in units of noise."""
    whitened: Whitened
    residual: ComplexMatrix
    """(channels, lines) white, without its part along h."""
    amplitude: ComplexVector
    """(lines,) of the base slab's acceleration."""
    unmodelled: ComplexTensor
    """(1 + floors, channels, lines) what rocking and single floors do, white; (0, channels, lines) if nothing is."""

    @property
    def degrees_of_freedom(self) -> float:
        """Of the misfit."""
        return float(self.residual.shape[1] * (len(self.residual) - 1))

    @property
    def chi_square(self) -> float:
        """Misfit per degree of freedom."""
        return float(self.misfit_by_band.sum()) / self.degrees_of_freedom


@dataclass(frozen=True, slots=True, eq=False)
class Slope:
    """How the cost changes with the parameters."""

    descent: Vector
    """(size,) its negative gradient."""
    normal: Matrix
    """(size, size) Gauss and Newton's approximation of its second derivatives."""


def evaluated(
    question: Question, parameters: Vector, variances: Variances, along: ComplexMatrix | None = None
) -> Evaluation:
    """Cost at the parameters.

    Args:
        question: what is to be found.
        parameters: (size,) as core.estimators.frame.superstructure_model.Layout says.
        variances: of unmodelled motion.
        along: (channels, lines) the h at which the determinant along h is taken; None for that of the parameters.
    """
    lines, design, hypothesis = question.lines, question.design, question.hypothesis
    structure, scale = superstructure(parameters, design), 1 / np.sqrt(lines.noise_at)
    sensors = scale * sensor_errors(parameters, design.layout, lines.angular)
    inputs = 2 + design.layout.floors if hypothesis.is_random else 1
    given = responses(structure, lines.angular, design.measured, sensors, inputs)
    ringing = np.zeros_like(sensors)
    amplitudes = parameters[design.layout.transients]
    ringing[1:] = sensors[1:] * floors_free_vibration(structure, lines, design.measured, amplitudes)
    whitened = _whitened(question, given, variances, scale)
    residual, amplitude = projected(whitened, scale * lines.spectra - ringing)
    misfit = np.sum(np.abs(residual) ** 2, axis=0)
    cost = float(misfit.sum()) + hypothesis.penalty(parameters)
    if hypothesis.is_random:
        log_determinant = whitened.log_determinant + _log_power(whitened, given.base if along is None else along)
        cost += float(log_determinant.sum())
    return Evaluation(
        question=question,
        parameters=parameters,
        variances=variances,
        structure=structure,
        cost=cost,
        misfit_by_band=np.asarray(np.bincount(lines.band, misfit, variances.rocking.size), dtype=float),
        given=given,
        ringing=ringing,
        whitened=whitened,
        residual=residual,
        amplitude=amplitude,
        unmodelled=whitened.of(given.acting[1:]),
    )


def sensor_errors(parameters: Vector, layout: Layout, angular: Vector) -> ComplexMatrix:
    """(channels, lines) what gains and clocks make of a motion."""
    clocks = np.exp(-1j * parameters[layout.delays][:, None] * angular)
    return np.asarray(np.exp(parameters[layout.gains])[:, None] * clocks)


def slope(here: Evaluation) -> Slope:
    """Descent of the cost, and how fast that changes."""
    hypothesis = here.question.hypothesis
    size = here.parameters.size
    descent, normal = np.zeros(size), np.zeros((size, size))
    if hypothesis.is_random:
        descent[: here.question.design.layout.structural] = _by_determinant(here)
    derivatives = _derivatives(here)
    moving = np.flatnonzero(hypothesis.std[: len(derivatives)] > 0)
    white = here.whitened.without_projection(derivatives[moving])
    along = np.sum(here.whitened.direction.conj() * white, axis=1)
    flat, flat_along = _real(white), _real(along)
    descent[moving] += 2 * flat @ _real(here.residual[None])[0]
    normal[np.ix_(moving, moving)] = 2 * (flat @ flat.T - flat_along @ flat_along.T)
    free = hypothesis.free
    descent[free] -= (here.parameters - hypothesis.mean)[free] / hypothesis.std[free] ** 2
    normal[free, free] += 1 / hypothesis.std[free] ** 2
    return Slope(descent, normal)


def amplitudes(here: Evaluation) -> ComplexMatrix:
    """(inputs, lines) of the base slab's acceleration and, where they are allowed for, of rocking and single floors."""
    met = np.einsum("icl,cl->il", here.unmodelled.conj(), here.residual)
    weights = here.variances.at(here.question.lines)[[0] + [1] * (len(met) - 1)][: len(met)]
    return np.vstack([here.amplitude, weights * met])


def _whitened(question: Question, given: Responses, variances: Variances, scale: Matrix) -> Whitened:
    if not question.hypothesis.is_random:
        return by_noise_alone(given.base)
    local = np.einsum("cl,cd,dl->lcd", scale, local_covariance(question.design), scale)
    rocking, floors = variances.at(question.lines)
    return whitened_by(variance_at(given, rocking, floors / DYNAMIC_SHARE, local, DYNAMIC_SHARE), given.base)


def _by_determinant(here: Evaluation) -> Vector:
    """(structural,) by how much a parameter lowers the determinant."""
    lines, design = here.question.lines, here.question.design
    weights = here.variances.at(lines)[[0] + [1] * design.layout.floors]
    inverse = here.whitened.back(here.unmodelled)
    return determinant_descent(here.structure, here.given, lines.angular, design.measured, inverse, weights)


def _derivatives(here: Evaluation) -> ComplexTensor:
    """(parameters, channels, lines) of the channels, in units of noise; without the transients of a record at rest."""
    lines, design = here.question.lines, here.question.design
    layout, given, acting = design.layout, here.given, amplitudes(here)
    where = (here.structure, given, lines.angular, design.measured, acting)
    derivatives = structural_derivatives(*where)
    if np.any(here.question.hypothesis.std[layout.masses]):
        derivatives[layout.masses] = mass_derivatives(*where)
    modelled = np.einsum("il,icl->cl", acting, given.acting) + here.ringing
    if lines.at_rest:
        return np.concatenate([derivatives, sensor_derivatives(modelled, lines.angular)])
    ringing = (here.structure, lines, design.measured)
    sensors, free = given.sensors[1:], here.parameters[layout.transients]
    derivatives[:, 1:] += sensors * free_vibration_changes(*ringing, free)
    by_amplitude = np.zeros((2 * layout.floors, *given.sensors.shape), dtype=complex)
    by_amplitude[:, 1:] = sensors * free_vibration_columns(*ringing)
    return np.concatenate([derivatives, sensor_derivatives(modelled, lines.angular), by_amplitude])


def _log_power(whitened: Whitened, along: ComplexMatrix) -> Vector:
    """(lines,) log hᴴ V⁻¹ h."""
    white = whitened.without_projection(along[None])[0]
    return np.asarray(np.log(np.sum(np.abs(white) ** 2, axis=0)))


def _real(series: ComplexTensor | ComplexMatrix) -> Matrix:
    """(rows, ...) real and imaginary parts of each row."""
    return np.ascontiguousarray(series).reshape(len(series), -1).view(float)
