"""Maximum likelihood modes where input and outputs are noisy alike: the base motion itself is estimated as well."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import ComplexMatrix, ComplexVector, Indices, Matrix, Vector
from core.identification.modal_transfer import (
    Basis,
    ModalTransfer,
    basis,
    free_motion,
    lateness,
    pole_changes,
    transfer_function,
)

LARGEST_STEPS = 60
FIRST_DAMPING = 1e-4
"""Of the diagonal of the information."""
MOST_RAISES = 30
"""Of the damping, tenfold each, within one step: more would not change the step."""
SMALL = 5e-2
"""Of the cost per degree of freedom, or of what noise makes it: a step that promises or brings less is the last."""


@dataclass(frozen=True, slots=True, eq=False)
class NoisyLines:
    """Spectra of base slab and floors at the frequencies that are used."""

    angular_frequency: Vector
    """(lines,) rad/s."""
    spectra: ComplexMatrix
    """(1 + floors, lines), the base slab first."""
    noise: Vector
    """(1 + floors,) standard deviation of a line: √E|e|²."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The most likely transfer, and how well it is known."""

    transfer: ModalTransfer
    covariance: Matrix
    """(parameters, parameters) of transfer.parameters, as large as the misfit says; NaN where the lines do not
    determine the parameters."""
    cost: float
    """Σ|z - g a|², z in standard deviations of the noise."""
    degrees_of_freedom: int
    converged: bool
    """False also where no step could be computed, as from lines that say nothing of a mode."""
    inverse_information: Matrix
    """(parameters, parameters) (JᵀJ)⁻¹."""

    @property
    def misfit(self) -> float:
        """Chi-square per degree of freedom: 1 where noise explains all that is left."""
        return 2 * self.cost / self.degrees_of_freedom


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """The cost around one transfer: Σ|r|², r = z - g a, a = gᴴz / gᴴg."""

    cost: float
    gradient: Vector
    """(parameters,) of half the cost."""
    information: Matrix
    """(parameters, parameters) JᵀJ: variance of the gradient, twice."""
    hessian: Matrix
    """(parameters, parameters) of half the cost, as is to be expected."""


def linearised(transfer: ModalTransfer, lines: NoisyLines) -> Linearised:
    """Cost, gradient and Hessian of the likelihood with the base motion profiled out.

    Per line z = [A_b, A_1 - T_1, ...]/σ and g = [1, H_1, ...]/σ. With d = dg a + dt the change of g a + t,
    P = I - g gᴴ/gᴴg and P z = r, the gradient is -Re dᴴ r. JᵀJ = Re dᴴ P d holds |a|², which noise makes too large by
    1 / gᴴg: without that it is the Hessian that is to be expected (Golub and Pereyra 1973 for the derivatives).
    """
    terms = basis(transfer, lines.angular_frequency)
    a, r, g = profiled(transfer, terms, lines)
    length = np.sqrt(np.sum(np.abs(g) ** 2, axis=0))
    count = transfer.parameters.size
    gradient, information = np.zeros(count), np.zeros((count, count))
    noise = np.zeros((count, count))
    along, noise_along = (np.zeros((count, a.size), dtype=complex) for _ in range(2))
    for floor, (own, of_g, change) in enumerate(changes(transfer, terms, lines, a), start=1):
        information[np.ix_(own, own)] += _gram(change)
        gradient[own] -= (change.conj() @ r[floor]).real
        along[own] += change * (g[floor].conj() / length)
        noise[np.ix_(own, own)] += _gram(of_g / length)
        noise_along[own] += of_g * (g[floor].conj() / length**2)
    information -= _gram(along)
    hessian = information - noise + _gram(noise_along)
    return Linearised(float(np.sum(np.abs(r) ** 2)), gradient, information, hessian)


def profiled(
    transfer: ModalTransfer, terms: Basis, lines: NoisyLines
) -> tuple[ComplexVector, ComplexMatrix, ComplexMatrix]:
    """(lines,) the most likely base motion a, (1 + floors, lines) the residual r, and g."""
    noise = lines.noise[:, None]
    w = lines.angular_frequency
    g = np.vstack([np.ones_like(terms.driven[:1]), transfer_function(transfer, terms, w)]) / noise
    z = lines.spectra / noise
    z[1:] -= free_motion(transfer, terms, w) / noise[1:]
    a = np.asarray(np.sum(g.conj() * z, axis=0) / np.sum(np.abs(g) ** 2, axis=0))
    return a, np.asarray(z - g * a), np.asarray(g)


def cost(transfer: ModalTransfer, lines: NoisyLines) -> float:
    """Σ|r|² of the most likely base motion; infinite where a mode would not decay."""
    if not (np.all(transfer.damping_ratio > 0) and np.all(transfer.angular_frequency > 0)):
        return np.inf
    return float(np.sum(np.abs(profiled(transfer, basis(transfer, lines.angular_frequency), lines)[1]) ** 2))


def changes(
    transfer: ModalTransfer, terms: Basis, lines: NoisyLines, a: ComplexVector
) -> Iterator[tuple[Indices, ComplexMatrix, ComplexMatrix]]:
    """Floor by floor: which parameters move it, and (these, lines) by how much they move its g and its g a + t."""
    w, m, row = lines.angular_frequency, transfer.angular_frequency.size, len(terms.driven) + len(terms.free) + 1
    relative, late = pole_changes(transfer, terms, w), lateness(transfer, w)
    h, t = transfer_function(transfer, terms, w) / late, free_motion(transfer, terms, w) / late
    for floor, (driven, free, noise) in enumerate(zip(transfer.driven, transfer.free, lines.noise[1:], strict=True)):
        modal = driven[:m, None] * terms.driven[:m]
        decay = sum((free[k : k + m, None] * terms.free[k : k + m] for k in range(0, min(2 * m, free.size), m)), 0)
        poles = (relative * modal).reshape(2 * m, -1)
        of_g = np.vstack([poles, terms.driven, np.zeros_like(terms.free), -1j * w * h[floor]]) * (late[floor] / noise)
        change = of_g * a
        change[: 2 * m] += (relative * decay).reshape(2 * m, -1) * (late[floor] / noise)
        change[2 * m + len(driven) : -1] = terms.free * (late[floor] / noise)
        change[-1] += -1j * w * t[floor] * (late[floor] / noise)
        yield np.append(np.arange(2 * m), 2 * m + floor * row + np.arange(row)), of_g, change


def _gram(rows: ComplexMatrix) -> Matrix:
    """(rows, rows) real part of the products of all pairs."""
    parts = np.hstack([rows.real, rows.imag])
    return parts @ parts.T


def fit(start: ModalTransfer, lines: NoisyLines) -> Fit:
    """The most likely transfer near a start, by Levenberg and Marquardt's damping of Newton's method."""
    transfer, here = start, linearised(start, lines)
    freedom = 2 * len(start.driven) * lines.angular_frequency.size - start.parameters.size
    damping, growth, converged = FIRST_DAMPING, 2.0, False
    for _ in range(LARGEST_STEPS):
        step = _step(here, damping)
        if step is None:
            break
        expected = -float(here.gradient @ step)
        moved = transfer.moved(step)
        decrease = here.cost - cost(moved, lines)
        if decrease > 0:
            gain = decrease / expected
            transfer, here = moved, linearised(moved, lines)
            damping, growth = damping * max(1 / 10, 1 - (2 * gain - 1) ** 3), 2.0
        else:
            damping, growth = damping * growth, 2 * growth
        small = SMALL * max(0.5, here.cost / freedom)
        if expected < small or 0 < decrease < small:
            converged = True
            break
    covariance, inverse = _covariance(here, freedom)
    return Fit(transfer, covariance, here.cost, freedom, converged, inverse)


def _step(here: Linearised, damping: float) -> Vector | None:
    """Newton's step with the diagonal raised, more where the Hessian is not positive there; None if there is none."""
    length = np.sqrt(np.diag(here.information))
    if not (np.all(length > 0) and np.isfinite(here.hessian).all() and np.isfinite(here.gradient).all()):
        return None
    scaled = here.hessian / np.outer(length, length)
    for raised in damping * 10.0 ** np.arange(MOST_RAISES):
        try:
            factor = linalg.cho_factor(scaled + raised * np.eye(length.size), check_finite=False)
        except linalg.LinAlgError:
            continue
        return np.asarray(-linalg.cho_solve(factor, here.gradient / length, check_finite=False) / length)
    return None


def _covariance(here: Linearised, freedom: int) -> tuple[Matrix, Matrix]:
    """H⁻¹ (JᵀJ / 2) H⁻¹, times the chi-square per degree of freedom where that is above 1; and (JᵀJ)⁻¹."""
    length = np.sqrt(np.diag(here.information))
    unknown = np.full_like(here.hessian, np.nan)
    if not (np.all(length > 0) and np.isfinite(here.hessian).all()):
        return unknown, unknown
    scale = np.outer(length, length)
    try:
        inverse = linalg.pinvh(here.hessian / scale, check_finite=False) / scale
        inverse_information = linalg.pinvh(here.information / scale, check_finite=False) / scale
    except linalg.LinAlgError:  # its eigenvalues did not converge
        return unknown, unknown
    covariance = inverse @ here.information @ inverse * 0.5 * max(1.0, 2 * here.cost / freedom)
    return np.asarray(covariance), np.asarray(inverse_information)
