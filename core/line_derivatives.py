"""How do the channels' spectral lines, and the variance at them, change with the parameters of a superstructure?"""

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, Indices, Matrix, Vector
from core.line_misfit import Responses, real_times
from core.superstructure_model import Superstructure, loads


def structural_derivatives(
    structure: Superstructure, given: Responses, angular: Vector, measured: Indices, amplitudes: ComplexMatrix
) -> ComplexTensor:
    """Derivatives of the channels by the structure's parameters, in the order of core.superstructure_model.Layout.

    Args:
        structure: of the building.
        given: its responses.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        amplitudes: (inputs, lines) of the inputs.

    Returns:
        (structural, channels, lines), 0 for the masses: those are `mass_derivatives`.
    """
    α, η, β = structure.damping
    w, compliance = angular, given.compliance
    coordinate = w**2 * compliance * real_times(structure.inputs[:, : len(amplitudes)], amplitudes)
    stiffening = -(1 + 1j * (w * α + η)) * compliance
    by_stiffness = stiffening * real_times(structure.stiffness_derivatives, coordinate)
    damped = -1j * coordinate * compliance
    stiff = structure.squared[:, None] * damped
    by_damping = np.array([α * w * stiff, η * stiff, β * w * damped])
    seen = structure.shapes[measured]
    storeys, floors = 1 + structure.mass.size, structure.mass.size
    at_channels = np.zeros((7 + 2 * floors, measured.size + 1, w.size), dtype=complex)
    at_channels[:storeys, 1:] = real_times(seen, by_stiffness[:storeys]) * given.sensors[1:]
    at_channels[storeys + floors : -3, 1:] = real_times(seen, by_stiffness[storeys:]) * given.sensors[1:]
    at_channels[-3:, 1:] = real_times(seen, by_damping) * given.sensors[1:]
    return at_channels


def mass_derivatives(
    structure: Superstructure, given: Responses, angular: Vector, measured: Indices, amplitudes: ComplexMatrix
) -> ComplexTensor:
    """(floors, channels, lines) derivatives of the channels by the masses' logarithms, their total held.

    Args: as of `structural_derivatives`.
    """
    w, compliance, shapes, β = angular, given.compliance, structure.shapes, structure.damping[2]
    inputs = len(amplitudes)
    moved = real_times(shapes, w**2 * compliance * real_times(structure.inputs[:, :inputs], amplitudes))
    load = w**2 * (real_times(loads(structure.mass.size)[:inputs].T, amplitudes) + moved) - 1j * w * β * moved
    receptance = real_times(shapes[measured] * shapes[:, None], compliance)
    by_mass = (structure.mass[:, None] * load)[:, None] * receptance
    by_mass -= (structure.mass / structure.mass.sum())[:, None, None] * by_mass.sum(axis=0)
    at_channels = np.zeros((len(by_mass), measured.size + 1, w.size), dtype=complex)
    at_channels[:, 1:] = by_mass * given.sensors[1:]
    return at_channels


def determinant_descent(
    structure: Superstructure,
    given: Responses,
    angular: Vector,
    measured: Indices,
    inverse: ComplexTensor,
    weights: Matrix,
) -> Vector:
    """By how much a structural parameter lowers the log determinant of V, h held: -2 Re Σ S Bᴴ P dB.

    Args:
        structure: of the building.
        given: its responses.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        inverse: (1 + floors, channels, lines) P R, and P B for every floor.
        weights: (1 + floors, lines) the variances S.

    Returns:
        (structural,) 0 for the masses, which are held wherever variances are not zero.
    """
    α, η, β = structure.damping
    w, compliance, floors = angular, given.compliance, structure.mass.size
    back = real_times(structure.shapes[measured].T, inverse[:, 1:].conj() * given.sensors[1:]) * compliance
    forth = w**2 * compliance * structure.inputs.T[1:, :, None] * weights[:, None]
    stiffening = 1 + 1j * (w * α + η)
    flat_forth, flat_back = (each.swapaxes(0, 1).reshape(floors, -1) for each in (forth, back * stiffening))
    through = (flat_forth @ flat_back.T).real
    by_stiffness = 2 * np.einsum("krs,sr->k", structure.stiffness_derivatives, through)
    own = np.einsum("irl,irl->rl", forth, back)
    by_damping = [
        2 * float(np.sum(1j * structure.squared[:, None] * w * α * own).real),
        2 * float(np.sum(1j * structure.squared[:, None] * η * own).real),
        2 * float(np.sum(1j * w * β * own).real),
    ]
    return np.concatenate([by_stiffness[: 1 + floors], np.zeros(floors), by_stiffness[1 + floors :], by_damping])


def sensor_derivatives(series: ComplexMatrix, angular: Vector) -> ComplexTensor:
    """(2 channels, channels, lines) derivatives of the channels by each one's gain, then by each one's delay."""
    channels = len(series)
    by_gain = np.zeros((channels, *series.shape), dtype=complex)
    by_gain[np.arange(channels), np.arange(channels)] = series
    return np.concatenate([by_gain, -1j * angular * by_gain])
