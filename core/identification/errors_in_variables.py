"""Maximum likelihood modal identification with noise in input and outputs alike (errors in variables).

`ModalTransfer` models the spectra of the floors as the modal response to the base slab's motion. `fit_transfer` finds
its most likely parameters. The base slab's true motion is unknown and estimated along with them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Indices, Matrix, Vector
from core.optimisation import Damping, GainRatioDamping, Quadratic, Step, lower_point, minimised
from core.signals.spectra import squared

RESIDUAL_TERMS = 4
"""Residual terms of a floor: 1 for its gain relative to the base slab's; ω², iω³ and ω⁴ for the stiffness, dashpots
and masses of the modes above the band."""
SMOOTH_TERMS = 3
"""Smooth transient terms of a floor, 1, iω and ω²: the part of the transient apart from the modes' free decay."""
MOST_STEPS = 60
"""Trial steps after which a fit ends without convergence. A choice."""
FIRST_DAMPING = GainRatioDamping(1e-4)
"""Damping of the first step, relative to the diagonal of the information matrix. Not tuned: starts are near."""
SMALL_DECREASE = 5e-2
"""Decrease of the cost at which a fit has converged, expected or achieved, in units of half the larger of one and chi-
square per degree of freedom. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class ModalTransfer:
    """Absolute accelerations of the floors by modes: A_j = H_j A_b + T_j, A_b being the base slab's.

    H_j = e^(-iωτ_j) (1 + Σ φ_jr ω² / D_r + residual terms) is the transfer function. The transient
    T_j = e^(-iωτ_j) (Σ (c_jr + iω d_jr) / D_r + smooth terms) belongs to a record that does not begin and end at rest.
    D_r = ω_r² - ω² + 2iζ_r ω_r ω (Pintelon and Schoukens 2012, chapters 6 and 8). Where a power of ω only scales a
    coefficient, it is in units of `scale`.
    """

    angular_frequency: Vector
    """(modes,) rad/s, ω_r, undamped."""
    damping_ratio: Vector
    """(modes,) ζ_r."""
    forced: Matrix
    """(floors, modes + RESIDUAL_TERMS) φ_jr, the shape times its participation factor; then the residual terms."""
    transient: Matrix
    """(floors, 2 modes + SMOOTH_TERMS) coefficients of T_j, or (floors, 0) for a record at rest at both ends."""
    delay: Vector
    """(floors,) s, τ_j, of each floor's clock relative to the base slab's."""
    scale: float
    """rad/s."""

    @property
    def parameters(self) -> Vector:
        """All parameters in one vector: ω, ζ, then floor by floor its forced and transient coefficients and delay."""
        coefficients = np.hstack([self.forced, self.transient, self.delay[:, None]])
        return np.concatenate([self.angular_frequency, self.damping_ratio, coefficients.ravel()])

    def plus(self, step: Vector) -> "ModalTransfer":
        """The transfer with a step added to its parameters."""
        m = self.angular_frequency.size
        coefficients = step[2 * m :].reshape(len(self.forced), -1)
        return replace(
            self,
            angular_frequency=self.angular_frequency + step[:m],
            damping_ratio=self.damping_ratio + step[m : 2 * m],
            forced=self.forced + coefficients[:, : self.forced.shape[1]],
            transient=self.transient + coefficients[:, self.forced.shape[1] : -1],
            delay=self.delay + coefficients[:, -1],
        )


@dataclass(frozen=True, slots=True, eq=False)
class BasisFunctions:
    """Functions of frequency that the coefficients of a ModalTransfer multiply."""

    inverse: ComplexMatrix
    """(modes, lines) 1 / D_r, s²."""
    forced: ComplexMatrix
    """(modes + RESIDUAL_TERMS, lines)"""
    transient: ComplexMatrix
    """(2 modes + SMOOTH_TERMS, lines), or (0, lines) without a transient."""


@dataclass(frozen=True, slots=True, eq=False)
class NoisySpectra:
    """Spectra of base slab and floors at the frequencies of the fit."""

    angular_frequency: Vector
    """(lines,) rad/s."""
    spectra: ComplexMatrix
    """(1 + floors, lines), the base slab first."""
    noise: Vector
    """(1 + floors,) standard deviation of a line, √E|e|²."""


@dataclass(frozen=True, slots=True, eq=False)
class TransferFit:
    """Most likely transfer, with its uncertainty."""

    transfer: ModalTransfer
    covariance: Matrix
    """(parameters, parameters) of transfer.parameters, enlarged by a misfit above 1; NaN if the lines do not determine
    the parameters."""
    cost: float
    """Σ|z - g a|², z in standard deviations of the noise."""
    degrees_of_freedom: int
    converged: bool
    """False also if no step could be computed, as from lines that do not depend on a mode."""
    inverse_information: Matrix
    """(parameters, parameters) (JᵀJ)⁻¹."""

    @property
    def misfit(self) -> float:
        """Chi-square per degree of freedom: 1 if noise explains the whole residual."""
        return 2 * self.cost / self.degrees_of_freedom


@dataclass(frozen=True, slots=True, eq=False)
class CostExpansion:
    """Second-order expansion of the cost Σ|r|² around a transfer; r = z - g a, a = gᴴz / gᴴg."""

    cost: float
    gradient: Vector
    """(parameters,) of half the cost."""
    information: Matrix
    """(parameters, parameters) JᵀJ: twice the variance of the gradient."""
    hessian: Matrix
    """(parameters, parameters) expected Hessian of half the cost."""


def basis_functions(transfer: ModalTransfer, w: Vector) -> BasisFunctions:
    """Basis functions at the angular frequencies w, (lines,) rad/s."""
    w_r, ratio = transfer.angular_frequency[:, None], transfer.damping_ratio[:, None]
    inverse = np.reciprocal(w_r**2 - w**2 + 2j * ratio * w_r * w)
    x = w / transfer.scale
    forced = np.vstack(
        [w**2 * inverse, np.ones_like(x)[None], *((1j**k * x ** (k + 2))[None] for k in range(RESIDUAL_TERMS - 1))]
    )
    if not transfer.transient.size:
        return BasisFunctions(inverse, forced, np.empty((0, w.size), dtype=complex))
    decay = transfer.scale**2 * inverse
    return BasisFunctions(
        inverse, forced, np.vstack([decay, 1j * x * decay, *((1j * x[None]) ** k for k in range(SMOOTH_TERMS))])
    )


def transfer_function(transfer: ModalTransfer, basis: BasisFunctions, w: Vector) -> ComplexMatrix:
    """(floors, lines) H_j, from the base slab's acceleration to each floor's."""
    return np.asarray((1 + transfer.forced @ basis.forced) * delay_factor(transfer, w))


def transient(transfer: ModalTransfer, basis: BasisFunctions, w: Vector) -> ComplexMatrix:
    """(floors, lines) T_j."""
    return np.asarray((transfer.transient @ basis.transient) * delay_factor(transfer, w))


def delay_factor(transfer: ModalTransfer, w: Vector) -> ComplexMatrix:
    """(floors, lines) e^(-iωτ_j)."""
    return np.asarray(np.exp(-1j * transfer.delay[:, None] * w))


def least_squares_coefficients(
    transfer: ModalTransfer, w: Vector, base: ComplexVector, floors: ComplexMatrix, noise: Vector
) -> ModalTransfer:
    """The transfer with the same poles whose coefficients fit the spectra by weighted least squares.

    The base slab's spectrum is assumed exact and all delays zero.

    Args:
        transfer: its poles are kept.
        w: (lines,) rad/s.
        base: (lines,) spectrum of the base slab's acceleration.
        floors: (floors, lines) spectra of the floors' accelerations.
        noise: (1 + floors,) standard deviation of a line of each, the base slab first.
    """
    basis = basis_functions(transfer, w)
    regressors = np.vstack([basis.forced * base, basis.transient])
    coefficients = []
    for spectrum, std in zip(floors, noise[1:], strict=True):
        weight = np.full(w.size, 1 / std)
        for _ in range(2):  # the second weights include the base slab's noise, amplified by the first transfer
            rows, right_side = regressors * weight, (spectrum - base) * weight
            normal = rows.real @ rows.real.T + rows.imag @ rows.imag.T
            right = rows.real @ right_side.real + rows.imag @ right_side.imag
            length = np.sqrt(np.diag(normal))
            solution = np.linalg.lstsq(normal / np.outer(length, length), right / length, rcond=None)[0] / length
            weight = 1 / np.hypot(std, noise[0] * np.abs(1 + solution[: len(basis.forced)] @ basis.forced))
        coefficients.append(solution)
    forced, of_transient = np.split(np.array(coefficients), [len(basis.forced)], axis=1)
    return replace(transfer, forced=forced, transient=of_transient)


@dataclass(frozen=True, eq=False)
class _Point:
    """A transfer and its cost."""

    transfer: ModalTransfer
    lines: NoisySpectra
    cost: float

    @cached_property
    def expansion(self) -> "CostExpansion":
        """Expansion of the cost around the transfer; most trials need none."""
        return cost_expansion(self.transfer, self.lines)

    def moved(self, step: Vector) -> "_Point":
        """Point at the parameters plus a step."""
        transfer = self.transfer.plus(step)
        return _Point(transfer, self.lines, cost(transfer, self.lines))


def fit_transfer(start: ModalTransfer, lines: NoisySpectra) -> TransferFit:
    """Most likely transfer near a start, by Newton's method with the damping of Levenberg and Marquardt."""
    freedom = 2 * len(start.forced) * lines.angular_frequency.size - start.parameters.size

    def step(here: _Point, damping: Damping) -> Step[_Point] | None:
        at = here.expansion
        curvature = np.sqrt(np.diag(at.information))
        return lower_point(here, Quadratic(at.hessian, -at.gradient, curvature), here.moved, damping, most_trials=1)

    def has_converged(_: _Point, latest: Step[_Point]) -> bool:
        small = SMALL_DECREASE * max(0.5, latest.point.cost / freedom)
        return latest.expected < small or 0 < latest.gained < small

    first = _Point(start, lines, _misfit(start, lines))
    end, converged = minimised(first, step, has_converged, FIRST_DAMPING, MOST_STEPS)
    covariance, inverse = _covariance(end.expansion, freedom)
    return TransferFit(end.transfer, covariance, end.cost, freedom, converged, inverse)


def cost(transfer: ModalTransfer, lines: NoisySpectra) -> float:
    """Σ|r|² for the most likely base motion; infinite if a mode does not decay."""
    if not (np.all(transfer.damping_ratio > 0) and np.all(transfer.angular_frequency > 0)):
        return np.inf
    return _misfit(transfer, lines)


def _misfit(transfer: ModalTransfer, lines: NoisySpectra) -> float:
    basis = basis_functions(transfer, lines.angular_frequency)
    return float(np.sum(squared(profiled_base_motion(transfer, basis, lines)[1])))


def profiled_base_motion(
    transfer: ModalTransfer, basis: BasisFunctions, lines: NoisySpectra
) -> tuple[ComplexVector, ComplexMatrix, ComplexMatrix]:
    """(lines,) most likely base motion a, (1 + floors, lines) residual r, and (1 + floors, lines) g."""
    noise = lines.noise[:, None]
    w = lines.angular_frequency
    late = delay_factor(transfer, w) / noise[1:]
    g = np.empty(lines.spectra.shape, dtype=complex)
    g[0] = 1 / noise[0]
    np.multiply(1 + transfer.forced @ basis.forced, late, out=g[1:])
    z = np.divide(lines.spectra, noise, order="C")
    if transfer.transient.size:
        z[1:] -= (transfer.transient @ basis.transient) * late
    a = np.asarray(np.sum(g.conj() * z, axis=0) / np.sum(squared(g), axis=0))
    return a, np.asarray(z - g * a), np.asarray(g)


def cost_expansion(transfer: ModalTransfer, lines: NoisySpectra) -> CostExpansion:
    """Cost, gradient and Hessian of the profile likelihood, in which the base motion takes its most likely value.

    On each line, z = [A_b, A_1 - T_1, ...]/σ and g = [1, H_1, ...]/σ. With d = dg a + dt the derivative of g a + t,
    P = I - g gᴴ/gᴴg and P z = r, the gradient is -Re dᴴ r. JᵀJ = Re dᴴ P d contains |a|², which noise makes too large
    by 1 / gᴴg; without that excess it is the expected Hessian (Golub and Pereyra 1973 for the derivatives).
    """
    basis = basis_functions(transfer, lines.angular_frequency)
    a, r, g = profiled_base_motion(transfer, basis, lines)
    length = np.sqrt(np.sum(squared(g), axis=0))
    count = transfer.parameters.size
    gradient, information = np.zeros(count), np.zeros((count, count))
    along, noise_along = (np.zeros((count, a.size), dtype=complex) for _ in range(2))
    noise, moving = np.zeros((count, count)), np.zeros(count, dtype=bool)
    poles = 2 * transfer.angular_frequency.size
    for floor, (own, of_g, change) in enumerate(floor_derivatives(transfer, basis, lines, a), start=1):
        information[np.ix_(own, own)] += _gram(change)
        gradient[own] -= change.view(float) @ r[floor].view(float)
        change *= g[floor].conj() / length
        along[:poles] += change[:poles]
        along[own[poles] : own[-1] + 1] = change[poles:]
        forced = np.append(own[: len(of_g) - 1], own[-1])
        moving[forced] = True
        of_g /= length
        noise[np.ix_(forced, forced)] += _gram(of_g)
        of_g *= g[floor].conj() / length
        noise_along[:poles] += of_g[:poles]
        noise_along[forced[poles:]] = of_g[poles:]
    information -= _gram(along)
    hessian = information - noise
    hessian[np.ix_(moving, moving)] += _gram(noise_along[moving])
    return CostExpansion(float(np.sum(squared(r))), gradient, information, hessian)


def floor_derivatives(
    transfer: ModalTransfer, basis: BasisFunctions, lines: NoisySpectra, a: ComplexVector
) -> Iterator[tuple[Indices, ComplexMatrix, ComplexMatrix]]:
    """Derivatives of each floor's g, and of its g a + t.

    Yields:
        For each floor, the indices of the parameters on which it depends; the derivatives of its g by those of them
        that are not of the transient, (these, lines); and those of its g a + t, (parameters, lines).
    """
    w, m, row = lines.angular_frequency, transfer.angular_frequency.size, len(basis.forced) + len(basis.transient) + 1
    relative, late = _pole_derivatives(transfer, basis, w), delay_factor(transfer, w)
    h, t = 1 + transfer.forced @ basis.forced, transfer.transient @ basis.transient
    of_floors = zip(transfer.forced, transfer.transient, lines.noise[1:], strict=True)
    for floor, (forced, free, noise) in enumerate(of_floors):
        turned, last = late[floor] / noise, 2 * m + len(forced)
        of_g = np.empty((last + 1, w.size), dtype=complex)
        np.multiply(relative, forced[:m, None] * basis.forced[:m], out=of_g[: 2 * m].reshape(2, m, -1))
        of_g[2 * m : last], of_g[last] = basis.forced, -1j * w * h[floor]
        of_g *= turned
        change = np.empty((2 * m + row, w.size), dtype=complex)
        np.multiply(of_g[:last], a, out=change[:last])
        np.multiply(of_g[last], a, out=change[-1])
        if free.size:
            decay = sum(free[k : k + m, None] * basis.transient[k : k + m] for k in (0, m))
            change[: 2 * m] += (relative * (decay * turned)).reshape(2 * m, -1)
            np.multiply(basis.transient, turned, out=change[last:-1])
            change[-1] += -1j * w * t[floor] * turned
        yield np.append(np.arange(2 * m), 2 * m + floor * row + np.arange(row)), of_g, change


def _pole_derivatives(transfer: ModalTransfer, basis: BasisFunctions, w: Vector) -> ComplexTensor:
    """(2, modes, lines) logarithmic derivatives of 1 / D_r with respect to ω_r (in s) and ζ_r."""
    w_r, ratio = transfer.angular_frequency[:, None], transfer.damping_ratio[:, None]
    derivatives = np.empty((2, *basis.inverse.shape), dtype=complex)
    np.multiply(-2 * w_r - 2j * ratio * w, basis.inverse, out=derivatives[0])
    np.multiply(-2j * w_r * w, basis.inverse, out=derivatives[1])
    return derivatives


def _gram(rows: ComplexMatrix) -> Matrix:
    """(rows, rows) real part of the Hermitian products of all pairs."""
    parts = np.ascontiguousarray(rows).view(float)
    gram: Matrix = parts @ parts.T
    return gram


def _covariance(here: CostExpansion, freedom: int) -> tuple[Matrix, Matrix]:
    """H⁻¹ (JᵀJ / 2) H⁻¹, times chi-square per degree of freedom if that is above 1; and (JᵀJ)⁻¹."""
    length = np.sqrt(np.diag(here.information))
    unknown = np.full_like(here.hessian, np.nan)
    if not (np.all(length > 0) and np.isfinite(here.hessian).all()):
        return unknown, unknown
    scale = np.outer(length, length)
    try:
        inverse = linalg.pinvh(here.hessian / scale, check_finite=False) / scale
        inverse_information = linalg.pinvh(here.information / scale, check_finite=False) / scale
    except linalg.LinAlgError:  # the eigenvalue iteration did not converge
        return unknown, unknown
    covariance = inverse @ here.information @ inverse * 0.5 * max(1.0, 2 * here.cost / freedom)
    return np.asarray(covariance), np.asarray(inverse_information)
