"""The floors' motion as modes of what the base slab does: a model of their spectra, and how it changes."""

from dataclasses import dataclass, replace

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector

RESIDUAL_TERMS = 4
"""1 for the gain against the base slab's; ω², iω³ and ω⁴: stiffness, dashpots and masses of the modes above."""
SMOOTH_TERMS = 3
"""1, iω and ω²: what cutting a record adds to its spectrum, apart from the modes' own decay."""


@dataclass(frozen=True, slots=True, eq=False)
class ModalTransfer:
    """A_j = H_j A_b + T_j, absolute accelerations, T_j being what a record that does not begin and end at rest adds.

    H_j = e^(-iωτ_j) (1 + Σ φ_jr ω² / D_r + residual terms) and T_j = e^(-iωτ_j) (Σ (c_jr + iω d_jr) / D_r + smooth
    terms), with D_r = ω_r² - ω² + 2iζ_r ω_r ω (Pintelon and Schoukens 2012, chapters 6 and 8). Frequencies are counted
    in units of `scale` wherever they only scale a coefficient.
    """

    angular_frequency: Vector
    """(modes,) rad/s, ω_r, undamped."""
    damping_ratio: Vector
    """(modes,) ζ_r."""
    driven: Matrix
    """(floors, modes + RESIDUAL_TERMS) φ_jr, the shape times its participation; then the residual terms."""
    free: Matrix
    """(floors, 2 modes + SMOOTH_TERMS) of T_j, or (floors, 0) for a record at rest at both ends."""
    delay: Vector
    """(floors,) s, τ_j, of each floor's clock against the base slab's."""
    scale: float
    """rad/s."""

    @property
    def parameters(self) -> Vector:
        """Everything in one vector: ω, ζ, then floor by floor its driven and free coefficients and its delay."""
        coefficients = np.hstack([self.driven, self.free, self.delay[:, None]])
        return np.concatenate([self.angular_frequency, self.damping_ratio, coefficients.ravel()])

    def moved(self, step: Vector) -> "ModalTransfer":
        """The transfer whose parameters are these and a step."""
        m = self.angular_frequency.size
        coefficients = step[2 * m :].reshape(len(self.driven), -1)
        return replace(
            self,
            angular_frequency=self.angular_frequency + step[:m],
            damping_ratio=self.damping_ratio + step[m : 2 * m],
            driven=self.driven + coefficients[:, : self.driven.shape[1]],
            free=self.free + coefficients[:, self.driven.shape[1] : -1],
            delay=self.delay + coefficients[:, -1],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """The terms of a transfer at the frequencies ω."""

    inverse: ComplexMatrix
    """(modes, lines) 1 / D_r, s²."""
    driven: ComplexMatrix
    """(modes + RESIDUAL_TERMS, lines)"""
    free: ComplexMatrix
    """(2 modes + SMOOTH_TERMS, lines), or none."""


def basis(transfer: ModalTransfer, w: Vector) -> Basis:
    """The terms at the frequencies (lines,) rad/s."""
    w_r, ratio = transfer.angular_frequency[:, None], transfer.damping_ratio[:, None]
    inverse = np.reciprocal(w_r**2 - w**2 + 2j * ratio * w_r * w)
    x = w / transfer.scale
    driven = np.vstack(
        [w**2 * inverse, np.ones_like(x)[None], *((1j**k * x ** (k + 2))[None] for k in range(RESIDUAL_TERMS - 1))]
    )
    if not transfer.free.size:
        return Basis(inverse, driven, np.empty((0, w.size), dtype=complex))
    decay = transfer.scale**2 * inverse
    return Basis(
        inverse, driven, np.vstack([decay, 1j * x * decay, *((1j * x[None]) ** k for k in range(SMOOTH_TERMS))])
    )


def pole_changes(transfer: ModalTransfer, terms: Basis, w: Vector) -> ComplexMatrix:
    """(2, modes, lines) relative change of every term of a mode with its ω_r (s) and its ζ_r."""
    w_r, ratio = transfer.angular_frequency[:, None], transfer.damping_ratio[:, None]
    return -np.array([2 * w_r + 2j * ratio * w, 2j * w_r * w]) * terms.inverse


def transfer_function(transfer: ModalTransfer, terms: Basis, w: Vector) -> ComplexMatrix:
    """(floors, lines) H."""
    return np.asarray((1 + transfer.driven @ terms.driven) * lateness(transfer, w))


def free_motion(transfer: ModalTransfer, terms: Basis, w: Vector) -> ComplexMatrix:
    """(floors, lines) T."""
    return np.asarray((transfer.free @ terms.free) * lateness(transfer, w))


def lateness(transfer: ModalTransfer, w: Vector) -> ComplexMatrix:
    """(floors, lines) e^(-iωτ)."""
    return np.asarray(np.exp(-1j * transfer.delay[:, None] * w))


def fitted_coefficients(
    transfer: ModalTransfer, w: Vector, base: ComplexVector, floors: ComplexMatrix, noise: Vector
) -> ModalTransfer:
    """The same poles with the coefficients that fit the spectra by weighted least squares, the base taken as it is.

    Delays are taken to be zero.

    Args:
        transfer: whose poles are kept.
        w: (lines,) rad/s.
        base: (lines,) spectrum of the base slab's acceleration.
        floors: (floors, lines) those of the floors.
        noise: (1 + floors,) standard deviation of a line of each, the base first.
    """
    terms = basis(transfer, w)
    regressors = np.vstack([terms.driven * base, terms.free])
    coefficients = []
    for spectrum, std in zip(floors, noise[1:], strict=True):
        weight = np.full(w.size, 1 / std)
        for _ in range(2):  # the base's noise comes in as large as the transfer found makes it
            rows, wanted = regressors * weight, (spectrum - base) * weight
            normal = rows.real @ rows.real.T + rows.imag @ rows.imag.T
            right = rows.real @ wanted.real + rows.imag @ wanted.imag
            length = np.sqrt(np.diag(normal))
            solution = np.linalg.lstsq(normal / np.outer(length, length), right / length, rcond=None)[0] / length
            weight = 1 / np.hypot(std, noise[0] * np.abs(1 + solution[: len(terms.driven)] @ terms.driven))
        coefficients.append(solution)
    driven, free = np.split(np.array(coefficients), [len(terms.driven)], axis=1)
    return replace(transfer, driven=driven, free=free)
