"""Modes: natural frequencies, damping ratios and mode shapes, from a state matrix or as identified."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """An identified fixed-base mode of the superstructure, its shape given at every floor."""

    frequency: float
    """Hz, undamped natural frequency."""
    damping_ratio: float
    shape: Vector
    """(floors,) mode shape relative to the base slab, 1 at the highest measured floor."""
    frequency_std: float | None = None
    """Hz, standard deviation of the frequency."""
    damping_ratio_std: float | None = None
    shape_std: Vector | None = None
    """(floors,) standard deviation of the shape; at floors without a sensor, propagated through the expansion. None
    where the mode was not refined: its values are then those of the subspace identification."""
    misfit: float | None = None
    """Chi-square per degree of freedom of the errors-in-variables fit: 1 where noise explains the whole residual."""


@dataclass(frozen=True, slots=True, eq=False)
class Poles:
    """The oscillatory modes of a discrete-time system, one of each conjugate pair, lowest frequency first."""

    eigenvalues: ComplexVector
    """(k,) eigenvalues of A, per sample."""
    frequency: Vector
    """(k,) Hz, undamped natural frequencies."""
    damping_ratio: Vector
    """(k,) negative for an unstable mode."""
    shapes: ComplexMatrix
    """(outputs, k) C times the eigenvectors, of arbitrary length and phase."""


def poles(A: Matrix, C: Matrix, rate: float) -> Poles:
    """Modes of x(t+1) = A x(t), y = C x, sampled at `rate` Hz: ln λ = (-ζ ± i√(1-ζ²)) ω / rate.

    With the base slab's absolute acceleration as the input and the floors' as the outputs, zero input means a base slab
    at rest. The shapes are therefore those of the motion relative to the slab.
    """
    eigenvalues, vectors = linalg.eig(A, check_finite=False)
    one_each = np.flatnonzero(eigenvalues.imag > 0)
    s = np.log(eigenvalues[one_each]) * rate
    order = np.argsort(np.abs(s))
    kept, s = one_each[order], s[order]
    frequency = np.abs(s) / (2 * np.pi)
    return Poles(eigenvalues[kept], frequency, -s.real / np.abs(s), C @ vectors[:, kept])


def real_shape(shape: ComplexVector) -> Vector:
    """The real mode shape nearest to a complex one rotated by any phase, scaled to 1 at the last entry.

    The rotation maximises the norm of the real part: minus half the angle of Σ φ².
    """
    real = np.real(shape * np.exp(-0.5j * np.angle(np.sum(shape**2))))
    return np.asarray(real / real[-1])


def modal_assurance(one: ComplexVector, other: ComplexVector) -> float:
    """Modal assurance criterion (MAC), Allemang and Brown (1982): 1 for proportional shapes, 0 for orthogonal ones."""
    lengths = np.vdot(one, one).real * np.vdot(other, other).real
    return float(abs(np.vdot(one, other)) ** 2 / lengths)


def mass_normalised(shapes: Matrix, mass: Vector) -> Matrix:
    """Mode shapes scaled to unit modal mass, φᵀ M φ = 1 (paper, eq 3-4).

    Args:
        shapes: (floors, modes) of any length.
        mass: (floors,) kg.

    Returns:
        (floors, modes) kg^(-1/2), with the signs of the given shapes.
    """
    return np.asarray(shapes / np.sqrt(mass @ shapes**2))
