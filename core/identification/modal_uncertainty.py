"""How far noise may have moved the frequency and damping ratio of an identified mode."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.errors import IdentificationError
from core.identification.realisation import realise
from core.identification.stabilisation import DiagramPole
from core.identification.subspace import ObservabilitySpan

MEMORY = 10
"""Samples over which the errors of one mode may be correlated: the anti-alias filter's reach."""


@dataclass(frozen=True, slots=True)
class ModalDeviation:
    """Standard deviations of one mode's estimates."""

    frequency: float
    """Hz."""
    damping_ratio: float


def modal_deviations(
    modes: Sequence[DiagramPole], span: ObservabilitySpan, order: int, rate: float
) -> tuple[ModalDeviation | None, ...]:
    """Standard deviations of frequencies and damping ratios, by first-order perturbation of the subspace estimate.

    Errors of the outputs move a pole by Σ_t h(t)ᵀ e(t), with h from `pole_influence`. For e stands what the model of
    the given order leaves unexplained, so that errors which grow with the motion count where they occur; the sum's
    variance is estimated after Newey and West (1987).

    It does not cover what biases an estimate: noise of the input (errors in variables), a superstructure that is not
    linear or changes during the record. It is asymptotic: a deviation above a third of the value says only that the
    record does not determine it.

    Args:
        modes: poles of the stabilisation diagram made of `span`.
        span: the observability matrix, and what it came from.
        order: of the model whose misfit is the noise: high enough to hold all that moved.
        rate: Hz.

    Returns:
        One for each mode; None where the record does not determine it at all, or is free of errors.
    """
    try:
        errors = output_errors(span, order)
        moves = [np.sum(pole_influence(mode, span) * errors, axis=0) for mode in modes]
    except (IdentificationError, linalg.LinAlgError):
        return (None,) * len(modes)
    return tuple(_deviation(mode.eigenvalue, move, rate) for mode, move in zip(modes, moves, strict=True))


def output_errors(span: ObservabilitySpan, order: int) -> Matrix:
    """What the model of that order, or of the highest the data holds, leaves of the outputs unexplained.

    Returns:
        (outputs, n), in the outputs' unit.

    Raises:
        IdentificationError: every mode of the model grows.
    """
    inputs, outputs = span.projection.inputs, span.projection.outputs
    system = realise(*span.system(min(order, span.columns.shape[1])), inputs, outputs)
    return np.asarray(outputs - system.response(inputs))


def pole_influence(mode: DiagramPole, span: ObservabilitySpan) -> ComplexMatrix:
    """By how much a pole of A moves when one sample of one output does.

    Errors E of the future outputs change the observability matrix Γ = L32 X by (I - ΓΓ⁺) E Q2ᵀ X, but for a change of
    basis (Viberg, Wahlberg and Ottersten 1997), and the eigenvalue with right and left vectors x and y by
    yᴴ Γ₁⁺ (δΓ₂ - λ δΓ₁) x / yᴴx, Γ₁ and Γ₂ being Γ without its last and first block row. Errors in the past do not
    count to first order: they do not turn Γ. For MOESP and CVA this is the derivative; N4SID divides by the past's
    noise, whatever its level, so that a few per cent of second order remain.

    Returns:
        (outputs, n) per unit of the output, zero for the first samples, which are nobody's future.

    Raises:
        scipy.linalg.LinAlgError: the record is free of errors, or at rest for so long that it has no inverse.
    """
    projection = span.projection
    r, p = projection.block_rows, len(projection.outputs)
    eigenvalues, left, right = linalg.eig(span.system(mode.order)[0], left=True, right=True, check_finite=False)
    i = int(np.argmin(np.abs(eigenvalues - mode.eigenvalue)))
    x, y_H = right[:, i], left[:, i].conj()
    observability = span.columns[:, : mode.order]
    change_of_A = y_H @ linalg.pinv(observability[:-p]) / (y_H @ x)
    rows = np.zeros(r * p, dtype=complex)
    rows[p:] += change_of_A
    rows[:-p] -= eigenvalues[i] * change_of_A
    rows -= (rows @ observability) @ span.left_inverse[: mode.order]
    instrument = _instrument(span, span.combination[:, : mode.order] @ x)
    influence = np.zeros(projection.outputs.shape, dtype=complex)
    influence[:, r:] = signal.fftconvolve(rows.reshape(r, p).T, instrument[None], axes=1)
    return influence


def _instrument(span: ObservabilitySpan, combination: ComplexVector) -> ComplexVector:
    """(n - 2 r + 1,) the combination of the rows of Q2 = L22⁻¹ (W_p - L21 L11⁻¹ U_f)."""
    projection = span.projection
    r, m, p = projection.block_rows, len(projection.inputs), len(projection.outputs)
    of_past = linalg.solve_triangular(projection.past, combination, trans="T", lower=True)
    of_future = linalg.solve_triangular(
        projection.future_input, projection.past_input.T @ of_past, trans="T", lower=True
    )
    of_inputs = np.concatenate([of_past[: r * m].reshape(r, m), -of_future.reshape(r, m)])
    of_outputs = of_past[r * m :].reshape(r, p)
    return np.asarray(_windowed(projection.inputs, of_inputs) + _windowed(projection.outputs[:, :-r], of_outputs))


def _windowed(series: Matrix, weights: ComplexMatrix) -> ComplexVector:
    """(n - length + 1,) sum of every window of (channels, n), each sample weighted by (length, channels)."""
    return np.asarray(signal.fftconvolve(series, weights[::-1].T, mode="valid", axes=1).sum(axis=0))


def _deviation(eigenvalue: complex, moves: ComplexVector, rate: float) -> ModalDeviation | None:
    """From the eigenvalue's moves by each sample's error: s = rate ln λ = (-ζ ± i√(1-ζ²)) ω."""
    s = np.log(eigenvalue) * rate
    change = rate * moves / eigenvalue
    of_modulus = (np.conj(s) * change).real / abs(s)
    of_ratio = -(change.real - s.real / abs(s) * of_modulus) / abs(s)
    frequency, damping_ratio = _deviation_of_sum(of_modulus / (2 * np.pi)), _deviation_of_sum(of_ratio)
    # What is not below the value itself, for damping below critical, is no standard deviation of anything.
    if not (0 < frequency < abs(s) / (2 * np.pi) and 0 < damping_ratio < 1):
        return None
    return ModalDeviation(frequency, damping_ratio)


def _deviation_of_sum(terms: Vector) -> float:
    """Standard deviation of the sum of terms that are correlated over a short time, Newey and West (1987)."""
    variance = float(terms @ terms)
    for lag in range(1, MEMORY + 1):
        variance += 2 * (1 - lag / (MEMORY + 1)) * float(terms[lag:] @ terms[:-lag])
    return float(np.sqrt(max(variance, 0.0)))
