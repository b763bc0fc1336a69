"""Derivatives of the channels' spectral lines, and of their variance, by the frame's parameters."""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, Indices, Matrix, Tensor, Vector
from core.estimators.frame.likelihood import Responses, real_times
from core.estimators.frame.model import Superstructure


@dataclass(frozen=True, slots=True, eq=False)
class DampingCoupling:
    """By each two modes, (modes, modes), with λ = ω² and ρ of core.estimators.frame.model: r down, s across.

    The derivative of a response Σ φ_r c_r L_r, with c_r = 1 / (λ_r - ω² + iρ_r (...)), by a change of the modal
    stiffness has at each two modes the quotient (c_r - c_s) / (λ_r - λ_s), by one of the modal mass that of λ c; these
    are their remainders over c_r c_s. The diagonals are the limits of s towards r.
    """

    stiff: Matrix
    """(ρ_r λ_r - ρ_s λ_s) / (λ_r - λ_s), 1 where all are damped alike."""
    uneven: Matrix
    """(ρ_r - ρ_s) / (λ_r - λ_s), s²/rad²; 0 where all are damped alike."""


def damping_coupling(structure: Superstructure) -> DampingCoupling:
    """Coupling of a superstructure's modes."""
    λ, ρ = structure.squared, structure.modal_damping
    apart = λ[:, None] - λ + np.eye(λ.size)
    stiff, uneven = ((one[:, None] - one) / apart for one in (ρ * λ, ρ))
    return DampingCoupling(stiff + np.diag(ρ), uneven)


def structural_derivatives(
    structure: Superstructure, given: Responses, angular: Vector, measured: Indices, amplitudes: ComplexMatrix
) -> ComplexTensor:
    """Derivatives of the channels by the structure's parameters, in the order of core.estimators.frame.model.Layout.

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
    coupling, by = damping_coupling(structure), structure.stiffness_derivatives
    coordinate, pairs = _coordinates(structure, given, angular, amplitudes)
    pairs *= 1 + 1j * (np.multiply.outer(coupling.stiff, w * α + η) + np.multiply.outer(coupling.uneven, w * β))
    seen, floors = structure.shapes[measured], structure.mass.size
    by_stiffness = _through_pairs(-seen, by, pairs)
    damped = -1j * structure.modal_damping[:, None] * coordinate * compliance
    stiff = structure.squared[:, None] * damped
    by_damping = np.array([α * w * stiff, η * stiff, β * w * damped])
    storeys, rates = 1 + floors, 4 + 2 * floors
    at_channels = np.zeros((rates + 3 + floors, measured.size + 1, w.size), dtype=complex)
    at_channels[:storeys, 1:] = by_stiffness[:storeys]
    at_channels[storeys + floors : rates, 1:] = by_stiffness[storeys:]
    at_channels[rates : rates + 3, 1:] = real_times(seen, by_damping)
    at_channels[rates + 3 :, 1:] = seen.T[:, :, None] * by_damping.sum(axis=0)[:, None]
    at_channels[:, 1:] *= given.sensors[1:]
    return at_channels


def _coordinates(
    structure: Superstructure, given: Responses, angular: Vector, amplitudes: ComplexMatrix
) -> tuple[ComplexMatrix, ComplexTensor]:
    """(modes, lines) acceleration of the modal coordinates; (modes, modes, lines) compliance r times coordinate s."""
    coordinate = angular**2 * given.compliance * real_times(structure.inputs[:, : len(amplitudes)], amplitudes)
    return coordinate, given.compliance[:, None] * coordinate


def _through_pairs(seen: Matrix, by: Tensor, pairs: ComplexTensor) -> ComplexTensor:
    """(parameters, channels - 1, lines) sums over pairs of modes.

    Args:
        seen: (channels - 1, modes) at the channels.
        by: (parameters, modes, modes).
        pairs: (modes, modes, lines).
    """
    weights = (by[:, None] * seen[:, :, None]).reshape(len(by) * len(seen), -1)
    summed = real_times(weights, pairs.reshape(weights.shape[1], -1))
    return np.asarray(summed.reshape(len(by), len(seen), -1))


def determinant_descent(
    structure: Superstructure,
    given: Responses,
    angular: Vector,
    measured: Indices,
    inverse: ComplexTensor,
    weights: Matrix,
) -> Vector:
    """Descent of the log determinant of V by the structure's parameters, h fixed: -2 Re Σ S Bᴴ P dB.

    Args:
        structure: of the building.
        given: its responses.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        inverse: (1 + floors, channels, lines) P R, and P B for every floor.
        weights: (1 + floors, lines) the variances S.

    Returns:
        (structural,) 0 for the masses, which are fixed wherever variances are not zero.
    """
    α, η, β = structure.damping
    w, compliance, floors = angular, given.compliance, structure.mass.size
    acting = real_times(structure.inputs[:, 1:], (weights[:, None] * inverse[:, 1:].conj()).reshape(1 + floors, -1))
    forth = acting.reshape(floors, measured.size, -1) * given.sensors[1:] * (w**2 * compliance)[:, None]
    seen, flat_forth = structure.shapes[measured], forth.reshape(-1, w.size)
    plain, stiff, uneven = (
        np.einsum("rcs,cs->rs", (flat_forth @ by.T).real.reshape(floors, measured.size, -1), seen)
        for by in (compliance, 1j * (w * α + η) * compliance, 1j * w * β * compliance)
    )
    coupling = damping_coupling(structure)
    through = plain + coupling.stiff * stiff + coupling.uneven * uneven
    by_stiffness = 2 * np.einsum("krs,sr->k", structure.stiffness_derivatives, through)
    own = 1j * structure.modal_damping[:, None] * compliance * np.einsum("rcl,cr->rl", forth, seen)
    stiffly = structure.squared[:, None] * own
    by_rates = 2 * np.array([w * α * stiffly, η * stiffly, w * β * own]).real.sum(axis=2)
    parts = by_stiffness[: 1 + floors], np.zeros(floors), by_stiffness[1 + floors :], by_rates.sum(axis=1)
    return np.concatenate([*parts, by_rates.sum(axis=0)])


def sensor_derivatives(series: ComplexMatrix, angular: Vector) -> ComplexTensor:
    """(2 channels, channels, lines) derivatives of the channels by each one's gain, then by each one's delay."""
    channels = len(series)
    by_gain = np.zeros((channels, *series.shape), dtype=complex)
    by_gain[np.arange(channels), np.arange(channels)] = series
    return np.concatenate([by_gain, -1j * angular * by_gain])
