"""Standard deviations of identified frequencies and damping ratios, by perturbation of the subspace estimate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from scipy import linalg

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.errors import IdentificationError
from core.identification.projection import Projection
from core.identification.stabilisation import DiagramPole
from core.identification.subspace import ExtendedObservability, realise
from core.signals.regression import covariance_of_sum

CORRELATION_LAGS = 10
"""Samples over which the errors of a mode may be correlated: the reach of the anti-alias filter."""


@dataclass(frozen=True, slots=True)
class ModalDeviation:
    """Standard deviations of a mode's frequency and damping ratio."""

    frequency: float
    """Hz."""
    damping_ratio: float


def modal_deviations(
    modes: Sequence[DiagramPole], observability: ExtendedObservability, order: int, rate: float
) -> tuple[ModalDeviation | None, ...]:
    """Standard deviations of frequencies and damping ratios, by first-order perturbation of the subspace estimate.

    Errors e of the outputs move a pole by Σ_t h(t)ᵀ e(t), with h from `pole_influence`. They are estimated by the
    residual of the model of the given order, so that errors which grow with the motion count where they occur. The
    variance of the sum is the estimate of Newey and West (1987).

    Bias is not included: noise of the input (errors in variables), a nonlinear superstructure, or one that changes
    during the record. The estimate is asymptotic: a standard deviation above a third of the value means only that the
    record does not determine the value.

    Args:
        modes: poles of the stabilisation diagram computed from `observability`.
        observability: the extended observability matrix, with the projection it comes from.
        order: of the model whose residual is the noise, high enough to hold all modes in the record.
        rate: Hz.

    Returns:
        One for each mode; None if the record does not determine the mode, or has no errors.
    """
    try:
        errors = output_errors(observability, order)
        moves = [np.sum(pole_influence(mode, observability) * errors, axis=0) for mode in modes]
    except (IdentificationError, linalg.LinAlgError):
        return (None,) * len(modes)
    return tuple(_deviation(mode.eigenvalue, move, rate) for mode, move in zip(modes, moves, strict=True))


def output_errors(observability: ExtendedObservability, order: int) -> Matrix:
    """Residual of the model of the given order, or of the highest order that the data supports.

    Returns:
        (outputs, n), in the outputs' unit.

    Raises:
        IdentificationError: every mode of the model is unstable.
    """
    inputs, outputs = observability.projection.inputs, observability.projection.outputs
    system = realise(*observability.system(min(order, observability.columns.shape[1])), inputs, outputs)
    return np.asarray(outputs - system.response(inputs))


def pole_influence(mode: DiagramPole, observability: ExtendedObservability) -> ComplexMatrix:
    """Derivative of a pole (an eigenvalue of A) with respect to every sample of every output.

    Errors E of the future outputs change the observability matrix Γ = L32 X by (I - ΓΓ⁺) E Q2ᵀ X, apart from a change
    of basis (Viberg, Wahlberg and Ottersten 1997), and the eigenvalue with right and left eigenvectors x and y by
    yᴴ Γ₁⁺ (δΓ₂ - λ δΓ₁) x / yᴴx, Γ₁ and Γ₂ being Γ without its last and first block row. Errors of the past do not
    rotate the range of Γ, so that they have no first-order effect. For MOESP and CVA this is the exact derivative.
    N4SID divides by the noise of the past, whatever its level, which leaves second-order terms of a few per cent.

    Returns:
        (outputs, n) per unit of the output; zero for the first samples, which belong to the past only.

    Raises:
        scipy.linalg.LinAlgError: the triangular factor is singular: the record has no errors, or is at rest for long.
    """
    projection = observability.projection
    r, p = projection.block_rows, len(projection.outputs)
    A, _ = observability.system(mode.order)
    eigenvalues, left, right = linalg.eig(A, left=True, right=True, check_finite=False)
    i = int(np.argmin(np.abs(eigenvalues - mode.eigenvalue)))
    x, y_H = right[:, i], left[:, i].conj()
    columns = observability.columns[:, : mode.order]
    change_of_A = y_H @ linalg.pinv(columns[:-p]) / (y_H @ x)
    rows = np.zeros(r * p, dtype=complex)
    rows[p:] += change_of_A
    rows[:-p] -= eigenvalues[i] * change_of_A
    rows -= (rows @ columns) @ observability.left_inverse[: mode.order]
    instrument = _instrument(projection, observability.combination[:, : mode.order] @ x)
    influence = np.zeros(projection.outputs.shape, dtype=complex)
    influence[:, r:] = scipy.signal.fftconvolve(rows.reshape(r, p).T, instrument[None], axes=1)
    return influence


def _instrument(projection: Projection, combination: ComplexVector) -> ComplexVector:
    """(n - 2 r + 1,) the given combination of the rows of Q2 = L22⁻¹ (W_p - L21 L11⁻¹ U_f)."""
    r, m, p = projection.block_rows, len(projection.inputs), len(projection.outputs)
    of_past = linalg.solve_triangular(projection.past, combination, trans="T", lower=True)
    of_future = linalg.solve_triangular(
        projection.future_input, projection.past_input.T @ of_past, trans="T", lower=True
    )
    of_inputs = np.concatenate([of_past[: r * m].reshape(r, m), -of_future.reshape(r, m)])
    of_outputs = of_past[r * m :].reshape(r, p)
    return np.asarray(_sliding_sum(projection.inputs, of_inputs) + _sliding_sum(projection.outputs[:, :-r], of_outputs))


def _sliding_sum(series: Matrix, weights: ComplexMatrix) -> ComplexVector:
    """(n - length + 1,) weighted sum over every window of (channels, n), with weights of (length, channels)."""
    return np.asarray(scipy.signal.fftconvolve(series, weights[::-1].T, mode="valid", axes=1).sum(axis=0))


def _deviation(eigenvalue: complex, moves: ComplexVector, rate: float) -> ModalDeviation | None:
    """Standard deviations from the eigenvalue's change by the errors of each sample.

    The continuous-time pole is s = rate ln λ = (-ζ ± i√(1-ζ²)) ω.
    """
    s = np.log(eigenvalue) * rate
    change = rate * moves / eigenvalue
    of_modulus = (np.conj(s) * change).real / abs(s)
    of_ratio = -(change.real - s.real / abs(s) * of_modulus) / abs(s)
    frequency, damping_ratio = _deviation_of_sum(of_modulus / (2 * np.pi)), _deviation_of_sum(of_ratio)
    # A standard deviation above the frequency itself, or above critical damping, has no meaning.
    if not (0 < frequency < abs(s) / (2 * np.pi) and 0 < damping_ratio < 1):
        return None
    return ModalDeviation(frequency, damping_ratio)


def _deviation_of_sum(terms: Vector) -> float:
    """Standard deviation of a sum of terms that are correlated over CORRELATION_LAGS."""
    return float(np.sqrt(max(covariance_of_sum(terms[:, None], CORRELATION_LAGS)[0, 0], 0.0)))
