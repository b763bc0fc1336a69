"""Misfit of a superstructure to the spectral lines of a record, with all that calibration needs.

At every line the channels are z = h a_b + R θ + B v + t + noise: the base slab's acceleration a_b, free; its rocking θ
and accelerations v of single floors, random, with variances by frequency band; t the free vibration left by the
record's ends. h, R and B are the structure's responses. V is the variance of all but a_b, and with
P = V⁻¹ - V⁻¹ h (hᴴ V⁻¹ h)⁻¹ hᴴ V⁻¹ the misfit is Σ zᴴ P z: errors in variables (Pintelon and Schoukens 2012).
All is in units of the channels' noise, whitened by W, Wᴴ W = V⁻¹, and then projected off h, so that P becomes a plain
sum of squares.
"""

from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Indices, Matrix, Tensor, Vector
from core.superstructure_model import Superstructure, loads, rigid_motion


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """What inputs do at the channels, line by line."""

    sensors: ComplexMatrix
    """(channels, lines) gains and delays, over the noise's root mean square."""
    compliance: ComplexMatrix
    """(modes, lines) s²: modal coordinate by unit modal load."""
    acting: ComplexTensor
    """(inputs, channels, lines) of the base slab's acceleration h; then, where they are allowed for, of its rocking R
    and of an acceleration of every floor alone B."""

    @property
    def base(self) -> ComplexMatrix:
        """(channels, lines) h."""
        return np.asarray(self.acting[0])


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """The lines as independent unit variables, h taken out."""

    whitening: ComplexTensor | None
    """(lines, channels, channels) W; None where V is the noise alone, of which all is in units."""
    direction: ComplexMatrix
    """(channels, lines) W h, of unit length."""
    length: Vector
    """(lines,) of W h."""
    log_determinant: Vector
    """(lines,) of V."""

    def of(self, series: ComplexTensor) -> ComplexTensor:
        """(k, channels, lines) whitened, without its part along h."""
        white = self.without_projection(series)
        return np.asarray(white - self.direction * np.sum(self.direction.conj() * white, axis=1, keepdims=True))

    def without_projection(self, series: ComplexTensor) -> ComplexTensor:
        """(k, channels, lines) whitened."""
        return series if self.whitening is None else np.einsum("lcd,kdl->kcl", self.whitening, series)

    def back(self, white: ComplexTensor) -> ComplexTensor:
        """(k, channels, lines) Wᴴ times what is white: P times a series of which that is the whitened one."""
        return white if self.whitening is None else np.einsum("lcd,kcl->kdl", self.whitening.conj(), white)


def responses(
    structure: Superstructure, angular: Vector, measured: Indices, sensors: ComplexMatrix, inputs: int
) -> Responses:
    """Of the inputs at the channels.

    Args:
        structure: of the building.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        sensors: (channels, lines) as in the result.
        inputs: how many of the base slab's acceleration, its rocking, every floor's own.
    """
    α, η, β = structure.damping
    dynamic = structure.squared[:, None] * (1 + 1j * (angular * α + η)) - angular**2 + 1j * angular * β
    compliance = np.asarray(1 / dynamic, dtype=complex)
    moved = structure.shapes[measured] * structure.inputs.T[:inputs, None]
    seen = _real_times(moved, angular**2 * compliance) + rigid_motion(structure.mass.size)[:inputs, measured, None]
    acting = np.zeros((inputs, *sensors.shape), dtype=complex)
    acting[0, 0] = 1.0
    acting[:, 1:] = seen
    acting *= sensors
    return Responses(sensors, compliance, acting)


def variance_at(
    given: Responses, rocking: Vector, floors: Vector, local: Matrix, dynamic_share: float
) -> ComplexTensor:
    """(lines, channels, channels) V.

    Args:
        given: responses.
        rocking: (lines,) variance of the rocking.
        floors: (lines,) variance of the floors' own motion.
        local: (channels, channels) covariance of a motion seen at sensors alone, over the noise.
        dynamic_share: of the floors' own motion that acts through the structure; the rest is local.
    """
    _, rocked_by, moved_by = np.split(given.acting, [1, 2])
    through = np.einsum("icl,idl->lcd", moved_by, moved_by.conj(), optimize=True)
    rocked = np.einsum("icl,idl->lcd", rocked_by, rocked_by.conj())
    own = dynamic_share * through + (1 - dynamic_share) * local
    return np.asarray(rocking[:, None, None] * rocked + floors[:, None, None] * own + np.eye(len(local)))


def whitened_by(variance: ComplexTensor, base: ComplexMatrix) -> Whitened:
    """Whitening by the inverse of V's Cholesky factor.

    Args:
        variance: (lines, channels, channels) V.
        base: (channels, lines) h.
    """
    whitening = np.asarray(np.linalg.inv(np.linalg.cholesky(variance)), dtype=complex)
    direction = np.einsum("lcd,dl->cl", whitening, base)
    length = np.linalg.norm(direction, axis=0)
    diagonal = np.einsum("lcc->lc", whitening).real
    return Whitened(whitening, direction / length, length, -2 * np.log(diagonal).sum(axis=1))


def by_noise_alone(base: ComplexMatrix) -> Whitened:
    """The same where V is the channels' noise: its determinant, a constant, is left out."""
    length = np.linalg.norm(base, axis=0)
    return Whitened(None, base / length, length, np.zeros_like(length))


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
    coordinate = w**2 * compliance * _real_times(structure.inputs[:, : len(amplitudes)], amplitudes)
    stiffening = -(1 + 1j * (w * α + η)) * compliance
    by_stiffness = stiffening * _real_times(structure.stiffness_derivatives, coordinate)
    damped = -1j * coordinate * compliance
    stiff = structure.squared[:, None] * damped
    by_damping = np.array([α * w * stiff, η * stiff, β * w * damped])
    seen = structure.shapes[measured]
    storeys, floors = 1 + structure.mass.size, structure.mass.size
    at_channels = np.zeros((7 + 2 * floors, measured.size + 1, w.size), dtype=complex)
    at_channels[:storeys, 1:] = _real_times(seen, by_stiffness[:storeys]) * given.sensors[1:]
    at_channels[storeys + floors : -3, 1:] = _real_times(seen, by_stiffness[storeys:]) * given.sensors[1:]
    at_channels[-3:, 1:] = _real_times(seen, by_damping) * given.sensors[1:]
    return at_channels


def mass_derivatives(
    structure: Superstructure, given: Responses, angular: Vector, measured: Indices, amplitudes: ComplexMatrix
) -> ComplexTensor:
    """(floors, channels, lines) derivatives of the channels by the masses' logarithms, their total held.

    Args: as of `structural_derivatives`.
    """
    w, compliance, shapes, β = angular, given.compliance, structure.shapes, structure.damping[2]
    inputs = len(amplitudes)
    moved = _real_times(shapes, w**2 * compliance * _real_times(structure.inputs[:, :inputs], amplitudes))
    load = w**2 * (_real_times(loads(structure.mass.size)[:inputs].T, amplitudes) + moved) - 1j * w * β * moved
    receptance = _real_times(shapes[measured] * shapes[:, None], compliance)
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
    back = _real_times(structure.shapes[measured].T, inverse[:, 1:].conj() * given.sensors[1:]) * compliance
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


def _real_times(matrices: Tensor | Matrix, series: ComplexTensor | ComplexMatrix) -> ComplexTensor:
    """Real matrices times complex series along their second last axis."""
    parts = np.ascontiguousarray(series).view(float)
    product: ComplexTensor = np.ascontiguousarray(matrices @ parts).view(complex)
    return product


def projected(whitened: Whitened, spectra: ComplexMatrix) -> tuple[ComplexMatrix, ComplexVector]:
    """(channels, lines) what h does not explain, whitened; (lines,) the amplitude a_b of what it does."""
    white = whitened.without_projection(spectra[None])[0]
    along = np.sum(whitened.direction.conj() * white, axis=0)
    return white - whitened.direction * along, along / whitened.length
