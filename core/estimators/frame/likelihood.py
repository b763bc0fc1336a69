"""Misfit of a superstructure to the spectral lines of a record.

At every line the channels are z = h a_b + R θ + B v + t + noise: the base slab's acceleration a_b, free; its rocking θ
and accelerations v of single floors, random, with variances by frequency band; t the free vibration left by the
record's ends. h, R and B are the structure's responses. V is the variance of all but a_b, and with
P = V⁻¹ - V⁻¹ h (hᴴ V⁻¹ h)⁻¹ hᴴ V⁻¹ the misfit is Σ zᴴ P z: errors in variables (Pintelon and Schoukens 2012).
All is in units of the channels' noise, whitened by W, Wᴴ W = V⁻¹, and then projected off h, so that P becomes a plain
sum of squares.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Indices, Matrix, Tensor, Vector
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design, Superstructure, rigid_motion
from core.signals.spectra import squared

DYNAMIC_SHARE = 0.2
"""Share of the floors' random motion that acts through the structure; the rest appears at the sensors alone. A
choice."""
FIRST_SHARE = 0.01
"""Share of the record's power at which the search for the variances starts. A choice."""


@dataclass(frozen=True, eq=False)  # without slots, for the cached property
class Responses:
    """Responses of the channels to the inputs, line by line."""

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

    @cached_property
    def unmodelled(self) -> tuple[ComplexTensor, ComplexTensor]:
        """Two (channels - 1, channels - 1, lines) covariances of the floors' channels: by rocking, and by accelerations
        of every floor alone, of variance 1."""
        channels, lines = self.acting.shape[1] - 1, self.acting.shape[2]
        rocking, floors = (np.empty((channels, channels, lines), dtype=complex) for _ in range(2))
        for row, column in zip(*np.tril_indices(channels), strict=True):
            met = self.acting[1:, 1 + row] * self.acting[1:, 1 + column].conj()
            rocking[row, column], floors[row, column] = met[0], met[1:].sum(axis=0)
            rocking[column, row], floors[column, row] = rocking[row, column].conj(), floors[row, column].conj()
        return rocking, floors

    def on(self, part: slice) -> "Responses":
        """Responses at a part of the lines."""
        return Responses(self.sensors[:, part], self.compliance[:, part], self.acting[..., part])


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """The lines as independent unit variables, without h."""

    whitening: ComplexTensor | None
    """(channels - 1, channels - 1, lines) W of the floors, lower triangular; None where V is the noise alone, of which
    all is in units, as at the base slab's channel."""
    direction: ComplexMatrix
    """(channels, lines) W h, of unit length."""
    length: Vector
    """(lines,) of W h."""
    log_determinant: Vector
    """(lines,) of V."""

    def on(self, part: slice) -> "Whitened":
        """Whitening of a part of the lines."""
        whitening = None if self.whitening is None else self.whitening[..., part]
        return Whitened(whitening, self.direction[:, part], self.length[part], self.log_determinant[part])

    def of(self, series: ComplexTensor) -> ComplexTensor:
        """(k, channels, lines) whitened, without its part along h."""
        white = self.without_projection(series)
        return np.asarray(white - self.direction * np.sum(self.direction.conj() * white, axis=1, keepdims=True))

    def without_projection(self, series: ComplexTensor) -> ComplexTensor:
        """(k, channels, lines) whitened."""
        return series if self.whitening is None else _floors_by(self.whitening, series)

    def back(self, white: ComplexTensor) -> ComplexTensor:
        """(k, channels, lines) Wᴴ times whitened series: P times the series themselves."""
        if self.whitening is None:
            return white
        transposed = self.whitening.conj().swapaxes(0, 1)[::-1, ::-1]  # lower triangular in reversed order
        back = white.copy()
        back[:, 1:] = _lower_times(transposed, white[:, :0:-1])[:, ::-1]
        return back


def responses(
    structure: Superstructure, angular: Vector, measured: Indices, sensors: ComplexMatrix, inputs: int
) -> Responses:
    """Responses of the channels to the inputs.

    Args:
        structure: of the building.
        angular: (lines,) rad/s.
        measured: (channels - 1,) floors with a sensor.
        sensors: (channels, lines) as in the result.
        inputs: number of inputs, from the base slab's acceleration, its rocking, every floor's own.
    """
    compliance = modal_compliance(structure, angular)
    moved = structure.shapes[measured] * structure.inputs.T[:inputs, None]
    acting = np.zeros((inputs, *sensors.shape), dtype=complex)
    acting[0, 0] = sensors[0]
    seen = real_times(moved, compliance)
    seen *= angular**2
    seen += rigid_motion(structure.mass.size)[:inputs, measured, None]
    np.multiply(seen, sensors[1:], out=acting[:, 1:])
    return Responses(sensors, compliance, acting)


def modal_compliance(structure: Superstructure, angular: Vector) -> ComplexMatrix:
    """(modes, lines) s²: modal coordinates by a unit modal load, 1 / (λ - ω² + iρ (λ (α ω + η) + β ω))."""
    λ, ρ, (α, η, β) = structure.squared, structure.modal_damping, structure.damping
    stiff = λ[:, None] - angular**2
    damped = np.multiply.outer(ρ * (λ * α + β), angular) + (ρ * λ * η)[:, None]
    size = stiff * stiff + damped * damped  # three times as fast as a complex division, which guards against overflow
    compliance = np.empty(stiff.shape, dtype=complex)
    np.divide(stiff, size, out=compliance.real)
    np.divide(-damped, size, out=compliance.imag)
    return np.asarray(compliance)


def variance_at(
    given: Responses, rocking: Vector, floors: Vector, local: Tensor, dynamic_share: float
) -> ComplexTensor:
    """(channels - 1, channels - 1, lines) V of the floors; the base slab's channel shows no such motion.

    Args:
        given: responses.
        rocking: (lines,) variance of the rocking.
        floors: (lines,) variance of the floors' own motion.
        local: (channels - 1, channels - 1, lines) covariance of a motion seen at sensors alone, over the noise.
        dynamic_share: of the floors' own motion that acts through the structure; the rest is local.
    """
    by_rocking, by_floors = given.unmodelled
    variance = rocking * by_rocking + (floors * dynamic_share) * by_floors
    variance += floors * (1 - dynamic_share) * local
    diagonal = np.arange(len(local))
    variance[diagonal, diagonal] += 1.0
    return np.asarray(variance)


def whitened_by(variance: ComplexTensor, base: ComplexMatrix) -> Whitened:
    """Whitening by the inverse of V's Cholesky factor.

    Args:
        variance: (channels - 1, channels - 1, lines) V of the floors.
        base: (channels, lines) h.

    Raises:
        LinAlgError: a V is not positive definite.
    """
    whitening = _inverse_cholesky(variance)
    direction = _floors_by(whitening, base[None])[0]
    length = np.linalg.norm(direction, axis=0)
    diagonal = np.einsum("ccl->cl", whitening).real
    return Whitened(whitening, direction / length, length, -2 * np.log(diagonal).sum(axis=0))


def _inverse_cholesky(variance: ComplexTensor) -> ComplexTensor:
    """(channels, channels, lines) inverses of the lower Cholesky factors: few channels and many lines, all at once."""
    channels = len(variance)
    factor, inverse = np.zeros_like(variance), np.zeros_like(variance)
    for row in range(channels):
        column = variance[row:, row] - np.einsum("ckl,kl->cl", factor[row:, :row], factor[row, :row].conj())
        pivot = column[0].real
        if not np.all(pivot > 0):
            raise np.linalg.LinAlgError("a variance of the spectral lines is not positive definite")
        factor[row:, row] = column / np.sqrt(pivot)
        inverse[row, row] = 1.0
        inverse[row, :row] = -np.einsum("kl,kcl->cl", factor[row, :row], inverse[:row, :row])
        inverse[row, : row + 1] /= np.sqrt(pivot)
    return inverse


def _floors_by(whitening: ComplexTensor, series: ComplexTensor) -> ComplexTensor:
    """(k, channels, lines) the floors whitened, the base slab as it is."""
    white = np.empty_like(series)
    white[:, 0], white[:, 1:] = series[:, 0], _lower_times(whitening, series[:, 1:])
    return white


def _lower_times(lower: ComplexTensor, series: ComplexTensor) -> ComplexTensor:
    """(k, channels, lines) product of (channels, channels, lines) lower triangular matrices with series."""
    product = np.empty_like(series)
    for row in range(len(lower)):
        product[:, row] = np.einsum("dl,kdl->kl", lower[row, : row + 1], series[:, : row + 1])
    return product


def by_noise_alone(base: ComplexMatrix) -> Whitened:
    """Whitening where V is the channels' noise; its determinant, a constant, is left out."""
    length = np.sqrt(squared(base).sum(axis=0))
    return Whitened(None, base * (1 / length), length, np.zeros_like(length))


def projected(whitened: Whitened, spectra: ComplexMatrix) -> tuple[ComplexMatrix, ComplexVector]:
    """(channels, lines) residual beside h, whitened; (lines,) the amplitude a_b along h."""
    white = whitened.without_projection(spectra[None])[0]
    along = np.sum(whitened.direction.conj() * white, axis=0)
    return white - whitened.direction * along, along / whitened.length


def real_times(matrices: Tensor | Matrix, series: ComplexTensor | ComplexMatrix) -> ComplexTensor:
    """Real matrices times complex series along their second last axis."""
    parts = np.ascontiguousarray(series).view(float)
    product: ComplexTensor = np.ascontiguousarray(matrices @ parts).view(complex)
    return product


@dataclass(frozen=True, slots=True, eq=False)
class Variances:
    """Variances of the motions that no parameter explains, by frequency band."""

    rocking: Vector
    """(bands,) of the base slab's rocking, as acceleration at the roof."""
    floors: Vector
    """(bands,) of accelerations at the floors."""

    @classmethod
    def none(cls, lines: Lines) -> "Variances":
        """Zero: the superstructure explains all."""
        return cls(np.zeros(lines.band.max() + 1), np.zeros(lines.band.max() + 1))

    @classmethod
    def first(cls, lines: Lines) -> "Variances":
        """A share of the record's power in each band."""
        count = np.bincount(lines.band)
        power = np.bincount(lines.band, np.mean(np.abs(lines.spectra) ** 2, axis=0))
        share = FIRST_SHARE * power / np.maximum(count, 1)
        return cls(share, share)

    def at(self, lines: Lines) -> Matrix:
        """(2, lines) variance of the rocking, and of any floor's own motion through the structure."""
        return np.vstack([self.rocking[lines.band], DYNAMIC_SHARE * self.floors[lines.band]])


def static_flexibility(design: Design) -> Matrix:
    """(floors, floors) static flexibility of the storeys as designed, 1 at the roof."""
    cumulated = np.cumsum(1 / design.storey_stiffness)
    flexibility = np.minimum.outer(cumulated, cumulated)
    return np.asarray(flexibility / flexibility[-1, -1])


def local_covariance(design: Design) -> Matrix:
    """(channels, channels) covariance of a motion that appears at sensors alone: the storeys' static flexibility, so
    that between sensors it is interpolated as by Guyan (1965)."""
    flexibility = static_flexibility(design)
    covariance = np.zeros((design.measured.size + 1,) * 2)
    covariance[1:, 1:] = flexibility[np.ix_(design.measured, design.measured)]
    return covariance
