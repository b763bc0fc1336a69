"""Gradient of the cost by the frame's parameters, and Gauss and Newton's approximation of its second derivatives."""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, Matrix, Vector
from core.estimators.frame.base_driven import base_driven_gradient
from core.estimators.frame.derivatives import determinant_descent, sensor_derivatives, structural_derivatives
from core.estimators.frame.evaluation import Evaluation
from core.estimators.frame.free_vibration import free_vibration_changes, free_vibration_columns
from core.signals.spectra import real_parts

BLOCK = 1800
"""Lines whose derivatives are computed at once where motion is random. With the 3,563 lines of a record of 180 s,
blocks of 500, 1,000 and 3,600 took 1.2, 1.05 and 2.8 times as long."""


@dataclass(frozen=True, slots=True, eq=False)
class Gradient:
    """Gradient and approximate second derivatives of the cost by the parameters."""

    descent: Vector
    """(size,) its negative gradient."""
    normal: Matrix
    """(size, size) Gauss and Newton's approximation of its second derivatives."""


def gradient(here: Evaluation) -> Gradient:
    """Descent of the cost, and the normal matrix, summed over blocks of lines."""
    hypothesis, size = here.problem.hypothesis, here.parameters.size
    descent, normal, free = np.zeros(size), np.zeros((size, size)), hypothesis.free
    if hypothesis.is_random:
        for first in range(0, here.amplitude.size, BLOCK):
            _add_random_lines(here.on(slice(first, first + BLOCK)), descent, normal)
    else:
        descent[free], normal[np.ix_(free, free)] = base_driven_gradient(here)
    descent[free] -= (here.parameters - hypothesis.mean)[free] / hypothesis.std[free] ** 2
    normal[free, free] += 1 / hypothesis.std[free] ** 2
    return Gradient(descent, normal)


def _add_random_lines(here: Evaluation, descent: Vector, normal: Matrix) -> None:
    """Add to the descent and the normal matrix, in place, the terms of the lines."""
    descent[: here.problem.design.layout.structural] += _by_determinant(here)
    derivatives = _derivatives(here)
    moving = np.flatnonzero(here.problem.hypothesis.std[: len(derivatives)] > 0)
    white = here.whitened.without_projection(derivatives[moving])
    along = np.sum(here.whitened.direction.conj() * white, axis=1)
    flat, flat_along = real_parts(white), real_parts(along)
    descent[moving] += 2 * flat @ real_parts(here.residual[None])[0]
    normal[np.ix_(moving, moving)] += 2 * (flat @ flat.T - flat_along @ flat_along.T)


def amplitudes(here: Evaluation) -> ComplexMatrix:
    """(inputs, lines) of the base slab's acceleration and, where they are allowed for, of rocking and single floors."""
    met = np.einsum("icl,cl->il", here.unmodelled.conj(), here.residual)
    weights = here.variances.at(here.problem.lines)[[0] + [1] * (len(met) - 1)][: len(met)]
    return np.vstack([here.amplitude, weights * met])


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
