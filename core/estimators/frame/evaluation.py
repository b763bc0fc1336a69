"""Negative log posterior probability of a choice of parameters, and its gradient."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Indices, Matrix, Vector
from core.estimators.frame.derivatives import (
    base_driven_derivatives,
    determinant_descent,
    sensor_derivatives,
    structural_derivatives,
)
from core.estimators.frame.free_vibration import floors_free_vibration, free_vibration_changes, free_vibration_columns
from core.estimators.frame.likelihood import (
    DYNAMIC_SHARE,
    Responses,
    Variances,
    Whitened,
    by_noise_alone,
    local_covariance,
    projected,
    responses,
    variance_at,
    whitened_by,
)
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design, Layout, Superstructure, superstructure
from core.signals.spectra import squared

BLOCK = 1800
"""Lines whose derivatives are computed at once. Measured with the 3,563 lines of a record of 180 s: in blocks of 500,
1,000 and 3,600 lines a gradient took 1.7, 1.2 and 0.9 times as long, with random motion 1.2, 1.05 and 2.8 times."""


@dataclass(frozen=True, eq=False)  # without slots, for the cached property
class Hypothesis:
    """Free parameters of a calibration with their prior."""

    name: str
    mean: Vector
    """(size,)"""
    std: Vector
    """(size,) 0 where a parameter is fixed."""
    is_random: bool
    """True if the base slab rocks and the floors move beyond the model."""

    @cached_property
    def free(self) -> Indices:
        """Indices of the parameters that are not fixed."""
        return np.flatnonzero(self.std > 0)

    def penalty(self, parameters: Vector) -> float:
        """Penalty by the prior, in units of a negative log likelihood."""
        free = self.free
        return 0.5 * float(np.sum(((parameters - self.mean)[free] / self.std[free]) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A calibration problem: lines, design, and the hypothesis that fixes the free parameters."""

    lines: Lines
    design: Design
    hypothesis: Hypothesis


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The lines as one choice of parameters explains them."""

    problem: Problem
    parameters: Vector
    variances: Variances
    structure: Superstructure
    cost: float
    """Negative log posterior probability, up to a constant."""
    misfit_by_band: Vector
    """(bands,)"""
    given: Responses
    free_vibration: ComplexMatrix
    """(channels, lines) the free vibration, in units of noise."""
    whitened: Whitened
    residual: ComplexMatrix
    """(channels, lines) white, without its part along h."""
    amplitude: ComplexVector
    """(lines,) of the base slab's acceleration."""
    unmodelled: ComplexTensor
    """(1 + floors, channels, lines) responses to rocking and single floors, white; (0, ...) without random motion."""

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the misfit."""
        return float(self.residual.shape[1] * (len(self.residual) - 1))

    @property
    def chi_square(self) -> float:
        """Misfit per degree of freedom."""
        return float(self.misfit_by_band.sum()) / self.degrees_of_freedom

    def on(self, part: slice) -> "Evaluation":
        """The same parameters on a part of the lines; cost and misfit remain those of all."""
        return replace(
            self,
            problem=replace(self.problem, lines=self.problem.lines.chosen(part)),
            given=self.given.on(part),
            free_vibration=self.free_vibration[:, part],
            whitened=self.whitened.on(part),
            residual=self.residual[:, part],
            amplitude=self.amplitude[part],
            unmodelled=self.unmodelled[..., part],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Gradient:
    """Gradient and approximate second derivatives of the cost by the parameters."""

    descent: Vector
    """(size,) its negative gradient."""
    normal: Matrix
    """(size, size) Gauss and Newton's approximation of its second derivatives."""


def evaluated(
    problem: Problem, parameters: Vector, variances: Variances, along: ComplexMatrix | None = None
) -> Evaluation:
    """Evaluation of the cost at the parameters.

    Args:
        problem: lines, design and hypothesis.
        parameters: (size,) in the order of core.estimators.frame.model.Layout.
        variances: of unmodelled motion.
        along: (channels, lines) the h at which the determinant along h is taken; None for that of the parameters.
    """
    lines, design, hypothesis = problem.lines, problem.design, problem.hypothesis
    structure = superstructure(parameters, design)
    sensors = lines.scale * sensor_errors(parameters, design.layout, lines.angular)
    inputs = 2 + design.layout.floors if hypothesis.is_random else 1
    given = responses(structure, lines.angular, design.measured, sensors, inputs)
    free_vibration = np.zeros_like(sensors)
    if not lines.at_rest:
        amplitudes = parameters[design.layout.transients]
        free_vibration[1:] = sensors[1:] * floors_free_vibration(structure, lines, design.measured, amplitudes)
    return _weighed(problem, parameters, variances, along, structure, given, free_vibration)


def with_variances(here: Evaluation, variances: Variances, along: ComplexMatrix | None = None) -> Evaluation:
    """Evaluation at the same parameters with other variances.

    Args: as of `evaluated`.
    """
    return _weighed(here.problem, here.parameters, variances, along, here.structure, here.given, here.free_vibration)


def _weighed(
    problem: Problem,
    parameters: Vector,
    variances: Variances,
    along: ComplexMatrix | None,
    structure: Superstructure,
    given: Responses,
    free_vibration: ComplexMatrix,
) -> Evaluation:
    lines, hypothesis = problem.lines, problem.hypothesis
    whitened = _whitened(problem, given, variances)
    residual, amplitude = projected(whitened, lines.scaled - free_vibration)
    misfit = np.sum(squared(residual), axis=0)
    cost = float(misfit.sum()) + hypothesis.penalty(parameters)
    if hypothesis.is_random:
        log_determinant = whitened.log_determinant + _log_power(whitened, given.base if along is None else along)
        cost += float(log_determinant.sum())
    return Evaluation(
        problem=problem,
        parameters=parameters,
        variances=variances,
        structure=structure,
        cost=cost,
        misfit_by_band=np.asarray(np.bincount(lines.band, misfit, variances.rocking.size), dtype=float),
        given=given,
        free_vibration=free_vibration,
        whitened=whitened,
        residual=residual,
        amplitude=amplitude,
        unmodelled=whitened.of(given.acting[1:]),
    )


def sensor_errors(parameters: Vector, layout: Layout, angular: Vector) -> ComplexMatrix:
    """(channels, lines) factor of gains and clocks on a motion."""
    delays, errors = parameters[layout.delays], np.ones((layout.channels, angular.size), dtype=complex)
    late = np.flatnonzero(delays)
    errors[late] = np.exp(-1j * delays[late, None] * angular)
    return np.asarray(np.exp(parameters[layout.gains])[:, None] * errors)


def gradient(here: Evaluation) -> Gradient:
    """Descent of the cost, and the normal matrix, summed over blocks of lines that a processor's cache has room for."""
    hypothesis = here.problem.hypothesis
    size = here.parameters.size
    descent, normal = np.zeros(size), np.zeros((size, size))
    for first in range(0, here.amplitude.size, BLOCK):
        _add_lines(here.on(slice(first, first + BLOCK)), descent, normal)
    free = hypothesis.free
    descent[free] -= (here.parameters - hypothesis.mean)[free] / hypothesis.std[free] ** 2
    normal[free, free] += 1 / hypothesis.std[free] ** 2
    return Gradient(descent, normal)


def _add_lines(here: Evaluation, descent: Vector, normal: Matrix) -> None:
    """Add to the descent and the normal matrix, in place, the terms of the lines."""
    (_add_random_lines if here.problem.hypothesis.is_random else _add_base_driven_lines)(here, descent, normal)


def _add_random_lines(here: Evaluation, descent: Vector, normal: Matrix) -> None:
    descent[: here.problem.design.layout.structural] += _by_determinant(here)
    derivatives = _derivatives(here)
    moving = np.flatnonzero(here.problem.hypothesis.std[: len(derivatives)] > 0)
    white = here.whitened.without_projection(derivatives[moving])
    along = np.sum(here.whitened.direction.conj() * white, axis=1)
    flat, flat_along = _real(white), _real(along)
    descent[moving] += 2 * flat @ _real(here.residual[None])[0]
    normal[np.ix_(moving, moving)] += 2 * (flat @ flat.T - flat_along @ flat_along.T)


def _add_base_driven_lines(here: Evaluation, descent: Vector, normal: Matrix) -> None:
    """The same where all is in units of the channels' noise, and the base slab's channel shows its own error alone."""
    lines, layout = here.problem.lines, here.problem.design.layout
    moving, floors = here.problem.hypothesis.free, _base_driven_derivatives(here)
    towards = here.whitened.direction.conj()
    along = towards[1] * floors[:, 0]
    for channel in range(1, floors.shape[1]):
        along += towards[1 + channel] * floors[:, channel]
    flat = _real(floors)
    descent[moving] += 2 * flat @ _real(here.residual[None, 1:])[0]
    block = flat @ flat.T
    base = np.flatnonzero((moving == layout.gains.start) | (moving == layout.delays.start))
    if base.size:
        by_gain = here.amplitude * here.given.base[0]
        shown = np.where(moving[base, None] == layout.gains.start, by_gain, -1j * lines.angular * by_gain)
        along[base] += towards[0] * shown
        flat_shown = _real(shown)
        descent[moving[base]] += 2 * flat_shown @ _real(here.residual[None, :1])[0]
        block[np.ix_(base, base)] += flat_shown @ flat_shown.T
    flat_along = _real(along)
    normal[np.ix_(moving, moving)] += 2 * (block - flat_along @ flat_along.T)


def amplitudes(here: Evaluation) -> ComplexMatrix:
    """(inputs, lines) of the base slab's acceleration and, where they are allowed for, of rocking and single floors."""
    met = np.einsum("icl,cl->il", here.unmodelled.conj(), here.residual)
    weights = here.variances.at(here.problem.lines)[[0] + [1] * (len(met) - 1)][: len(met)]
    return np.vstack([here.amplitude, weights * met])


def _whitened(problem: Problem, given: Responses, variances: Variances) -> Whitened:
    if not problem.hypothesis.is_random:
        return by_noise_alone(given.base)
    scale = problem.lines.scale
    local = local_covariance(problem.design)[1:, 1:, None] * scale[1:, None] * scale[1:]
    rocking, floors = variances.at(problem.lines)
    return whitened_by(variance_at(given, rocking, floors / DYNAMIC_SHARE, local, DYNAMIC_SHARE), given.base)


def _by_determinant(here: Evaluation) -> Vector:
    """(structural,) decrease of the determinant by a parameter."""
    lines, design = here.problem.lines, here.problem.design
    weights = here.variances.at(lines)[[0] + [1] * design.layout.floors]
    inverse = here.whitened.back(here.unmodelled)
    return determinant_descent(here.structure, here.given, lines.angular, design.measured, inverse, weights)


def _derivatives(here: Evaluation) -> ComplexTensor:
    """(parameters, channels, lines) of the channels, in units of noise; without the transients of a record at rest."""
    lines, design = here.problem.lines, here.problem.design
    layout, given, acting = design.layout, here.given, amplitudes(here)
    where = (here.structure, given, lines.angular, design.measured, acting)
    derivatives = structural_derivatives(*where)
    modelled = np.einsum("il,icl->cl", acting, given.acting) + here.free_vibration
    if lines.at_rest:
        return np.concatenate([derivatives, sensor_derivatives(modelled, lines.angular)])
    vibrating = (here.structure, lines, design.measured)
    sensors, free = given.sensors[1:], here.parameters[layout.transients]
    derivatives[:, 1:] += sensors * free_vibration_changes(*vibrating, free)
    by_amplitude = np.zeros((2 * layout.floors, *given.sensors.shape), dtype=complex)
    by_amplitude[:, 1:] = sensors * free_vibration_columns(*vibrating)
    return np.concatenate([derivatives, sensor_derivatives(modelled, lines.angular), by_amplitude])


def _base_driven_derivatives(here: Evaluation) -> ComplexTensor:
    """(free, channels - 1, lines) of the floors' channels by the free parameters, in units of noise."""
    lines, design, given = here.problem.lines, here.problem.design, here.given
    layout, free, sensors = design.layout, here.problem.hypothesis.free, here.given.sensors[1:]
    structural = free[free < layout.structural]
    derivatives = np.zeros((free.size, *sensors.shape), dtype=complex)
    derivatives[: structural.size] = base_driven_derivatives(
        here.structure, given, lines.angular, design.measured, here.amplitude, structural
    )
    modelled = here.amplitude * given.base[1:] + here.free_vibration[1:]
    late = -1j * lines.angular * modelled
    for channel in range(layout.channels - 1):
        for series, first in ((modelled, layout.gains.start), (late, layout.delays.start)):
            derivatives[free == first + 1 + channel, channel] = series[channel]
    if not lines.at_rest:
        vibrating, amplitudes = (here.structure, lines, design.measured), here.parameters[layout.transients]
        derivatives[: structural.size] += sensors * free_vibration_changes(*vibrating, amplitudes)[structural]
        derivatives[free >= layout.transients.start] = sensors * free_vibration_columns(*vibrating)
    return derivatives


def _log_power(whitened: Whitened, along: ComplexMatrix) -> Vector:
    """(lines,) log hᴴ V⁻¹ h."""
    white = whitened.without_projection(along[None])[0]
    return np.asarray(np.log(np.sum(squared(white), axis=0)))


def _real(series: ComplexTensor | ComplexMatrix) -> Matrix:
    """(rows, ...) real and imaginary parts of each row."""
    return np.ascontiguousarray(series).reshape(len(series), -1).view(float)
