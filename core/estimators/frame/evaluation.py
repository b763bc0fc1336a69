"""Negative log posterior probability of a choice of parameters."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Indices, Vector
from core.estimators.frame.free_vibration import floors_free_vibration
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
from core.signals.spectra import delay_factors, squared


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


@dataclass(frozen=True, eq=False)  # without slots, for the cached property
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

    @cached_property
    def unmodelled(self) -> ComplexTensor:
        """(1 + floors, channels, lines) responses to rocking and single floors, white; (0, ...) without random motion.
        Most trials need none."""
        return self.whitened.of(self.given.acting[1:])

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
        if part.indices(self.amplitude.size) == (0, self.amplitude.size, 1):
            return self
        return replace(
            self,
            problem=replace(self.problem, lines=self.problem.lines.chosen(part)),
            given=self.given.on(part),
            free_vibration=self.free_vibration[:, part],
            whitened=self.whitened.on(part),
            residual=self.residual[:, part],
            amplitude=self.amplitude[part],
        )


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
        power = 2 * np.log(whitened.length) if along is None else _log_power(whitened, along)
        log_determinant = whitened.log_determinant + power
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
    )


def sensor_errors(parameters: Vector, layout: Layout, angular: Vector) -> ComplexMatrix:
    """(channels, lines) factor of gains and clocks on a motion."""
    delays, errors = parameters[layout.delays], np.empty((layout.channels, angular.size), dtype=complex)
    errors[:] = np.exp(parameters[layout.gains])[:, None]
    late = np.flatnonzero(delays)
    if late.size:
        errors[late] *= delay_factors(delays[late], angular)
    return errors


def _whitened(problem: Problem, given: Responses, variances: Variances) -> Whitened:
    if not problem.hypothesis.is_random:
        return by_noise_alone(given.base)
    scale = problem.lines.scale
    local = local_covariance(problem.design)[1:, 1:, None] * scale[1:, None] * scale[1:]
    rocking, floors = variances.at(problem.lines)
    return whitened_by(variance_at(given, rocking, floors / DYNAMIC_SHARE, local, DYNAMIC_SHARE), given.base)


def _log_power(whitened: Whitened, along: ComplexMatrix) -> Vector:
    """(lines,) log hᴴ V⁻¹ h."""
    white = whitened.without_projection(along[None])[0]
    return np.asarray(np.log(np.sum(squared(white), axis=0)))
