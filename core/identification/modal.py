"""Frequencies, damping ratios and shapes of a discrete-time system's modes."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector


@dataclass(frozen=True, slots=True, eq=False)
class Poles:
    """The oscillating modes of one system, one of each conjugate pair, lowest frequency first."""

    eigenvalues: ComplexVector
    """(k,) of A, per sample."""
    frequency: Vector
    """(k,) Hz, undamped."""
    damping_ratio: Vector
    """(k,), negative where the mode grows."""
    shapes: ComplexMatrix
    """(outputs, k) C times the eigenvectors, of any length and phase."""


def poles(A: Matrix, C: Matrix, rate: float) -> Poles:
    """Modes of x(t+1) = A x(t), y = C x, sampled at `rate` Hz: ln λ = (-ζ ± i√(1-ζ²)) ω / rate.

    With the base slab's absolute acceleration as input and the floors' as output, the input at rest means the slab
    at rest, so that the shapes are those of the motion relative to the slab.
    """
    eigenvalues, vectors = linalg.eig(A, check_finite=False)
    one_each = np.flatnonzero(eigenvalues.imag > 0)
    s = np.log(eigenvalues[one_each]) * rate
    order = np.argsort(np.abs(s))
    kept, s = one_each[order], s[order]
    frequency = np.abs(s) / (2 * np.pi)
    return Poles(eigenvalues[kept], frequency, -s.real / np.abs(s), C @ vectors[:, kept])


def real_shape(shape: ComplexVector) -> Vector:
    """The real vector nearest to a complex shape but for its phase, 1 at the last entry.

    The phase is that which maximises the real part's length: half the angle of Σ φ².
    """
    real = np.real(shape * np.exp(-0.5j * np.angle(np.sum(shape**2))))
    return np.asarray(real / real[-1])


def modal_assurance(one: ComplexVector, other: ComplexVector) -> float:
    """Modal assurance criterion, Allemang and Brown (1982): 1 for the same shape but for a factor, 0 if orthogonal."""
    lengths = np.vdot(one, one).real * np.vdot(other, other).real
    return float(abs(np.vdot(one, other)) ** 2 / lengths)


def mass_normalised(shapes: Matrix, mass: Vector) -> Matrix:
    """Mode shapes of modal mass one, φᵀ M φ = 1 each (paper, eq 3-4).

    Args:
        shapes: (floors, modes) of any length.
        mass: (floors,) kg.

    Returns:
        (floors, modes) kg^(-1/2), of the signs given.
    """
    return np.asarray(shapes / np.sqrt(mass @ shapes**2))
