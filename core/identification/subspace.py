"""Combined deterministic-stochastic subspace identification of a state-space model (paper, eq 11-12 and 16-19).

A and C follow from the range of the extended observability matrix; B, D and the initial state then follow by least
squares on the simulated output.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import scipy
from scipy import linalg

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.errors import IdentificationError
from core.identification.projection import Projection

RANK_TOLERANCE = 1e-10
"""Ratio to the largest singular value below which a direction is rounding error rather than data. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class WeightedProjection:
    """The weighted projection W1 L32 W2, whose singular value decomposition gives the model.

    A weighting that is None is the identity matrix.
    """

    matrix: Matrix
    row_weighting: Matrix | None = None
    """W1."""
    row_unweighting: Matrix | None = None
    """Left inverse of W1 on the range of L32."""
    column_weighting: Matrix | None = None
    """W2."""


Weighting = Callable[[Projection], WeightedProjection]


def moesp(projection: Projection) -> WeightedProjection:
    """MOESP, Verhaegen (1994): rows unweighted, columns Y_f Π Φᵀ(ΦΠΦᵀ)⁻¹ΦΠ."""
    return WeightedProjection(projection.future)


def n4sid(projection: Projection) -> WeightedProjection:
    """N4SID, Van Overschee and De Moor (1994): oblique projection of the future output on the past.

    Its columns are Y_f Π Φᵀ(ΦΠΦᵀ)⁻¹Φ.
    """
    W2 = linalg.pinv(projection.past, rtol=RANK_TOLERANCE) @ np.hstack([projection.past_input, projection.past])
    return WeightedProjection(projection.future @ W2, column_weighting=W2)


def cva(projection: Projection) -> WeightedProjection:
    """Canonical variate analysis, Larimore (1990): rows weighted by (Y_f Π Y_fᵀ)^(-1/2)."""
    U, s, _ = linalg.svd(np.hstack([projection.future, projection.residual]), full_matrices=False)
    kept = s > RANK_TOLERANCE * s[0]
    U, s = U[:, kept], s[kept]
    W1 = (U / s).T
    return WeightedProjection(W1 @ projection.future, row_weighting=W1, row_unweighting=U * s)


WEIGHTINGS: Mapping[str, Weighting] = MappingProxyType({"n4sid": n4sid, "moesp": moesp, "cva": cva})
"""The classical choices of the two weighting matrices (Ljung 1999, table 10.1)."""


def is_identifiable(*, outputs: int, inputs: int, references: int, regulators: int = 1) -> bool:
    """Necessary condition for identifying the plant of a closed loop, r ≥ (n_y + n_u)/(n_y + n_r) (paper, eq 11).

    For a superstructure above its isolation layer, the base slab's acceleration is the input and the ground's
    acceleration is the reference.
    """
    return regulators * (outputs + references) >= outputs + inputs


@dataclass(frozen=True, slots=True, eq=False)
class ExtendedObservability:
    """The extended observability matrix, its columns in order of falling singular value (paper, eq 19)."""

    projection: Projection
    columns: Matrix
    """(block_rows * outputs, k) U_1 S_1^(1/2), with the row weighting undone."""
    singular_values: Vector
    """(k,)"""
    left_inverse: Matrix
    """(k, block_rows * outputs) times the columns gives the identity matrix."""
    combination: Matrix
    """(rows of the past, k) X in Γ = L32 X, Γ being the columns."""

    def system(self, order: int) -> tuple[Matrix, Matrix]:
        """A (order, order) by shift invariance, and C (outputs, order), the first block row.

        Raises:
            IdentificationError: the data supports fewer states.
        """
        if order > self.columns.shape[1]:
            raise IdentificationError(f"the data supports {self.columns.shape[1]} states, {order} were requested")
        observability, p = self.columns[:, :order], len(self.projection.outputs)
        A = linalg.lstsq(observability[:-p], observability[p:], check_finite=False)[0]
        return A, observability[:p]


def extended_observability(projection: Projection, weighting: Weighting) -> ExtendedObservability:
    """Extended observability matrix from the singular values of the weighted projection (paper, eq 19).

    Raises:
        IdentificationError: the outputs do not depend on the past, as in a record at rest.
    """
    weighted = weighting(projection)
    if not weighted.matrix.size or not np.any(weighted.matrix):
        raise IdentificationError("the outputs do not depend on their past; use a record with motion")
    U, s, Vt = linalg.svd(weighted.matrix, full_matrices=False)
    kept = s > RANK_TOLERANCE * s[0]
    root = np.sqrt(s[kept])
    columns, left_inverse, combination = U[:, kept] * root, (U[:, kept] / root).T, Vt[kept].T / root
    if weighted.row_weighting is not None and weighted.row_unweighting is not None:
        columns, left_inverse = weighted.row_unweighting @ columns, left_inverse @ weighted.row_weighting
    if weighted.column_weighting is not None:
        combination = weighted.column_weighting @ combination
    return ExtendedObservability(projection, columns, s[kept], left_inverse, combination)


@dataclass(frozen=True, slots=True, eq=False)
class StateSpace:
    """x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t) from x(0) (paper, eq 12 without noise)."""

    A: Matrix
    """(order, order)"""
    B: Matrix
    """(order, inputs)"""
    C: Matrix
    """(outputs, order)"""
    D: Matrix
    """(outputs, inputs)"""
    initial_state: Vector
    """(order,) x(0)."""

    def response(self, inputs: Matrix) -> Matrix:
        """(outputs, n) to inputs of (inputs, n), by modal superposition: A must be diagonalisable."""
        eigenvalues, vectors = linalg.eig(self.A, check_finite=False)
        one = eigenvalues.imag >= 0  # of each conjugate pair, which responds by twice the real part
        shapes = self.C @ vectors[:, one] * np.where(eigenvalues[one].imag > 0, 2, 1)
        forcing = np.hstack([self.initial_state[:, None], self.B @ inputs[:, :-1]])
        modal = np.linalg.inv(vectors)[one] @ forcing
        for mode, w in zip(modal, eigenvalues[one], strict=True):
            mode[:] = scipy.signal.lfilter([1], [1, -w], mode)
        return np.asarray((shapes @ modal).real + self.D @ inputs)


def realise(A: Matrix, C: Matrix, inputs: Matrix, outputs: Matrix) -> StateSpace:
    """State-space model with the B, D and x(0) that minimise the output error for given A and C (paper, section 4).

    The result is in real modal form, in which the response of each mode is one filter. Unstable modes are left out: a
    superstructure has none, and their simulated output would exceed all others.

    Args:
        A: (order, order), diagonalisable.
        C: (outputs, order).
        inputs: (m, n).
        outputs: (p, n).

    Raises:
        IdentificationError: every mode is unstable.
    """
    eigenvalues, vectors = linalg.eig(A, check_finite=False)
    kept = (np.abs(eigenvalues) < 1) & (eigenvalues.imag >= 0)
    if not kept.any():
        raise IdentificationError("every mode of the system grows; try another order")
    eigenvalues, shapes = eigenvalues[kept], C @ vectors[:, kept]
    solution = _input_coefficients(_modal_responses(eigenvalues, inputs), shapes, inputs, outputs)
    m, p, modes = len(inputs), len(outputs), len(eigenvalues)
    modal = solution[: -m * p].reshape(2, m + 1, modes)
    states = np.stack([modal[0], modal[1]], axis=-1).reshape(m + 1, 2 * modes)
    output_matrix = np.stack([2 * shapes.real, -2 * shapes.imag], axis=-1).reshape(p, 2 * modes)
    return StateSpace(
        A=linalg.block_diag(*([[w.real, -w.imag], [w.imag, w.real]] for w in eigenvalues)),
        B=states[:m].T,
        C=output_matrix,
        D=solution[-m * p :].reshape(p, m),
        initial_state=states[m],
    )


def _modal_responses(eigenvalues: ComplexVector, inputs: Matrix) -> ComplexMatrix:
    """(n, (m + 1) modes) response of each mode to each input, and to a unit initial state."""
    forced = [[scipy.signal.lfilter([0, 1], [1, -w], u) for w in eigenvalues] for u in inputs]
    impulse = np.eye(1, inputs.shape[1])[0]
    free = [scipy.signal.lfilter([1], [1, -w], impulse) for w in eigenvalues]
    return np.array([*forced, free]).reshape(-1, inputs.shape[1]).T


def _input_coefficients(responses: ComplexMatrix, shapes: ComplexMatrix, inputs: Matrix, outputs: Matrix) -> Vector:
    """Entries of B and x(0), real parts before imaginary parts, and of D.

    An output responds by 2 Re(c s) to a real entry and by -2 Im(c s) to an imaginary one. All outputs share the
    responses s, so that one QR factorisation of these removes time from the problem before it is solved.
    """
    k, p = responses.shape[1], len(shapes)
    regressors = np.hstack([responses.real, responses.imag, inputs.T])
    # of the modes of scipy.linalg.qr, "r" would copy as many rows of zeros as there are samples
    R = linalg.qr(np.hstack([regressors, outputs.T]), mode="raw", overwrite_a=True, check_finite=False)[1]
    R, rotated = np.split(R[: regressors.shape[1]], [regressors.shape[1]], axis=1)
    seen = np.tile(shapes, k // shapes.shape[1])[:, None, :]
    real = 2 * (seen.real * R[:, :k] - seen.imag * R[:, k : 2 * k])
    imaginary = -2 * (seen.imag * R[:, :k] + seen.real * R[:, k : 2 * k])
    direct = np.kron(np.eye(p), R[:, 2 * k :])
    design = np.hstack([real.reshape(-1, k), imaginary.reshape(-1, k), direct])
    return np.asarray(linalg.lstsq(design, rotated.T.ravel(), lapack_driver="gelsy", check_finite=False)[0])
