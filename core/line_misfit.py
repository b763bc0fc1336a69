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
from core.superstructure_model import Superstructure


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """What inputs do at the channels, line by line."""

    sensors: ComplexMatrix
    """(channels, lines) gains and delays, over the noise's root mean square."""
    compliance: ComplexMatrix
    """(modes, lines) s²: modal coordinate's acceleration by unit modal load, over ω²."""
    base: ComplexMatrix
    """(channels, lines) h, of the base slab's acceleration."""
    rocking: ComplexMatrix
    """(channels, lines) R, of its rocking."""
    floors: ComplexTensor
    """(floors, channels, lines) B, of an acceleration of one floor alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """The lines as independent unit variables, h taken out."""

    whitening: ComplexTensor | None
    """(lines, channels, channels) W; None where V is the noise alone, of which all is in units."""
    direction: ComplexMatrix
    """(channels, lines) W h, of unit length."""
    length: Vector
    """(lines,) of W h."""
    log_determinant: float
    """Of all V."""

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
    structure: Superstructure, angular: Vector, measured: Indices, height: Vector, sensors: ComplexMatrix
) -> Responses:
    """Of every input at the channels.

    Args:
        structure: of the building.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        height: (floors,) over the roof's.
        sensors: (channels, lines) as in the result.
    """
    α, η, β = structure.damping
    dynamic = structure.squared[:, None] * (1 + 1j * (angular * α + η)) - angular**2 + 1j * angular * β
    compliance = np.asarray(1 / dynamic, dtype=complex)
    moved = structure.shapes[measured][:, :, None] * structure.inputs
    seen = np.einsum("fmi,ml->ifl", moved, angular**2 * compliance, optimize=True)
    seen[0] += 1.0
    seen[1] += height[measured][:, None]
    at_channels = np.zeros((seen.shape[0], sensors.shape[0], angular.size), dtype=complex)
    at_channels[0, 0] = 1.0
    at_channels[:, 1:] = seen
    at_channels *= sensors
    return Responses(sensors, compliance, at_channels[0], at_channels[1], at_channels[2:])


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
    through = np.einsum("icl,idl->lcd", given.floors, given.floors.conj(), optimize=True)
    rocked = np.einsum("cl,dl->lcd", given.rocking, given.rocking.conj())
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
    return Whitened(whitening, direction / length, length, -2 * float(np.log(diagonal).sum()))


def by_noise_alone(base: ComplexMatrix) -> Whitened:
    """The same where V is the channels' noise: its determinant, a constant, is left out."""
    length = np.linalg.norm(base, axis=0)
    return Whitened(None, base / length, length, 0.0)


def structural_derivatives(
    structure: Superstructure,
    given: Responses,
    angular: Vector,
    measured: Indices,
    height: Vector,
    inputs: ComplexMatrix,
) -> ComplexTensor:
    """Derivatives of the channels by the structure's parameters, in the order of core.superstructure_model.Layout.

    Args:
        structure: of the building.
        given: its responses.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        height: (floors,) over the roof's.
        inputs: (2 + floors, lines) amplitudes of the base slab's acceleration, its rocking, the floors' own.

    Returns:
        (structural, channels, lines), 0 for the masses: those are `mass_derivatives`.
    """
    α, η, β = structure.damping
    w, compliance, shapes = angular, given.compliance, structure.shapes
    coordinate = w**2 * compliance * (structure.inputs @ inputs)
    stiffening = (1 + 1j * (w * α + η)) * compliance
    by_stiffness = -stiffening * _real_times(structure.stiffness_derivatives, coordinate)
    damped = -coordinate * compliance
    by_damping = np.array(
        [
            damped * structure.squared[:, None] * 1j * w * α,
            damped * structure.squared[:, None] * 1j * η,
            damped * 1j * w * β,
        ]
    )
    at_floors = _real_times(shapes[measured][None], np.concatenate([by_stiffness, by_damping]))
    storeys = 1 + structure.mass.size
    at_channels = np.zeros((len(at_floors) + structure.mass.size, measured.size + 1, w.size), dtype=complex)
    at_channels[:storeys, 1:] = at_floors[:storeys] * given.sensors[1:]
    at_channels[storeys + structure.mass.size :, 1:] = at_floors[storeys:] * given.sensors[1:]
    return at_channels


def mass_derivatives(
    structure: Superstructure,
    given: Responses,
    angular: Vector,
    measured: Indices,
    height: Vector,
    inputs: ComplexMatrix,
) -> ComplexTensor:
    """(floors, channels, lines) derivatives of the channels by the masses' logarithms, their total held.

    Args: as of `structural_derivatives`.
    """
    w, compliance, shapes, β = angular, given.compliance, structure.shapes, structure.damping[2]
    coordinate = w**2 * compliance * (structure.inputs @ inputs)
    moved = _real_times(shapes[None], coordinate)[0]
    load = w**2 * (inputs[0] + height[:, None] * inputs[1] + inputs[2:] + moved) - 1j * w * β * moved
    receptance = np.einsum("fm,im,ml->ifl", shapes[measured], shapes, compliance, optimize=True)
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
    back = np.einsum("icl,cm->iml", inverse[:, 1:].conj() * given.sensors[1:], structure.shapes[measured]) * compliance
    forth = w**2 * compliance * structure.inputs.T[1:, :, None] * weights[:, None]
    stiffening = 1 + 1j * (w * α + η)
    through = np.einsum("isl,irl->sr", forth, back * stiffening, optimize=True)
    by_stiffness = 2 * np.einsum("krs,sr->k", structure.stiffness_derivatives, through).real
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


def _real_times(matrices: Tensor, series: ComplexTensor | ComplexMatrix) -> ComplexTensor:
    """Real matrices times complex series along their second last axis."""
    parts = np.ascontiguousarray(series).view(float)
    product: ComplexTensor = np.ascontiguousarray(matrices @ parts).view(complex)
    return product


def projected(whitened: Whitened, spectra: ComplexMatrix) -> tuple[ComplexMatrix, ComplexVector]:
    """(channels, lines) what h does not explain, whitened; (lines,) the amplitude a_b of what it does."""
    white = whitened.without_projection(spectra[None])[0]
    along = np.sum(whitened.direction.conj() * white, axis=0)
    return white - whitened.direction * along, along / whitened.length
