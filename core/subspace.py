"""Input-output subspace identification: a state-space model from what was measured (paper, eq 12-19)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import IdentificationError

NEGLIGIBLE = 1e-10
"""Share of the largest singular value below which a direction is rounding, not data."""


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """The lower triangle of [U_f; W_p; Y_f] = L Q, row blocks future input, past, future output.

    Eq 16 in these terms: Y_f Π = L32 Q2 + L33 Q3 and W_p Π = L22 Q2, so that no N x N matrix is ever formed.
    """

    past_input: Matrix
    """L21, (rows of the past, rows of the future input)."""
    past: Matrix
    """L22, (rows of the past, the same)."""
    future: Matrix
    """L32, (rows of the future output, rows of the past)."""
    unexplained: Matrix
    """L33, (rows of the future output, the same): what the past does not explain."""


@dataclass(frozen=True, slots=True, eq=False)
class Weighted:
    """The matrix whose singular value decomposition is taken, and the way back from its columns."""

    matrix: Matrix
    unweight: Matrix | None = None
    """Left inverse of the row weighting; None where the rows are not weighted."""


Weighting = Callable[[Projection], Weighted]


def moesp(projection: Projection) -> Weighted:
    """Verhaegen (1994): rows as they are, columns Y_f Π Φᵀ(ΦΠΦᵀ)⁻¹ΦΠ."""
    return Weighted(projection.future)


def n4sid(projection: Projection) -> Weighted:
    """Van Overschee and De Moor (1994): the oblique projection of the future output on the past, Y_f Π Φᵀ(ΦΠΦᵀ)⁻¹Φ."""
    coefficients = projection.future @ linalg.pinv(projection.past, rtol=NEGLIGIBLE)
    return Weighted(coefficients @ np.hstack([projection.past_input, projection.past]))


def cva(projection: Projection) -> Weighted:
    """Larimore (1990): canonical correlations, rows weighted by (Y_f Π Y_fᵀ)^(-1/2)."""
    U, s, _ = linalg.svd(np.hstack([projection.future, projection.unexplained]), full_matrices=False)
    kept = s > NEGLIGIBLE * s[0]
    U, s = U[:, kept], s[kept]
    return Weighted(U.T @ projection.future / s[:, None], unweight=U * s)


WEIGHTINGS: Mapping[str, Weighting] = MappingProxyType({"n4sid": n4sid, "moesp": moesp, "cva": cva})
"""The classical choices of the two weighting matrices (Ljung 1999, table 10.1)."""


def is_identifiable(*, outputs: int, inputs: int, references: int, regulators: int = 1) -> bool:
    """The necessary condition for identifying the plant of a closed loop, r ≥ (n_y + n_u)/(n_y + n_r) (eq 11).

    For a superstructure above its isolation layer the slab's acceleration is the input and the ground's the reference.
    """
    return regulators * (outputs + references) >= outputs + inputs


def block_hankel(series: Matrix, block_rows: int) -> Matrix:
    """Y_r(1) ... Y_r(N) side by side (eq 13, 15).

    Args:
        series: (channels, n).
        block_rows: r, number of samples one below the other.

    Returns:
        (block_rows * channels, n - block_rows + 1), a copy, time-major within a column.
    """
    windows = np.lib.stride_tricks.sliding_window_view(series, block_rows, axis=1)
    return windows.transpose(2, 0, 1).reshape(block_rows * series.shape[0], -1)


def project(inputs: Matrix, outputs: Matrix, block_rows: int) -> Projection:
    """Remove the future input from the data equation and correlate with the past (eq 15-18), by LQ.

    The instruments Φ are the past inputs and outputs. The columns are taken in batches, so that memory is that of a
    few triangles however long the record.

    Args:
        inputs: (m, n).
        outputs: (p, n), same scale as the inputs within a few orders of magnitude.
        block_rows: r, of the past and of the future.

    Raises:
        IdentificationError: the record is too short for that many block rows.
    """
    m, (p, n) = inputs.shape[0], outputs.shape
    rows = 2 * block_rows * (m + p)
    if n - 2 * block_rows + 1 < rows:
        raise IdentificationError(
            f"{n} samples are too few for {block_rows} block rows of {m} inputs and {p} outputs; "
            f"at least {rows + 2 * block_rows - 1} samples, or fewer block rows, would do"
        )
    R = _triangle(inputs, outputs, block_rows)
    a, b = block_rows * m, block_rows * (2 * m + p)
    L = R.T
    return Projection(past_input=L[a:b, :a], past=L[a:b, a:b], future=L[b:, a:b], unexplained=L[b:, b:])


def _triangle(inputs: Matrix, outputs: Matrix, block_rows: int) -> Matrix:
    """The upper triangle Lᵀ of [U_f; W_p; Y_f]ᵀ = Q Lᵀ."""
    rows = 2 * block_rows * (inputs.shape[0] + outputs.shape[0])
    columns = inputs.shape[1] - 2 * block_rows + 1
    R = np.empty((0, rows))
    for start in range(0, columns, 4 * rows):
        stop = min(start + 4 * rows, columns) + 2 * block_rows - 1
        U = block_hankel(inputs[:, start:stop], 2 * block_rows)
        Y = block_hankel(outputs[:, start:stop], 2 * block_rows)
        past = U.shape[0] // 2
        batch = np.vstack([U[past:], U[:past], Y])
        R = linalg.qr(np.vstack([R, batch.T]), mode="r", overwrite_a=True, check_finite=False)[0][:rows]
    return R


@dataclass(frozen=True, slots=True, eq=False)
class ObservabilitySpan:
    """The extended observability matrix, its columns ordered by how much of the data each carries (eq 19)."""

    columns: Matrix
    """(block_rows * outputs, k) U_1 S_1^(1/2), the row weighting taken back."""
    singular_values: Vector
    """(k,)"""
    outputs: int

    def system(self, order: int) -> tuple[Matrix, Matrix]:
        """A (order, order) by shift invariance and C (outputs, order), the first block row.

        Raises:
            IdentificationError: the data does not hold that many states.
        """
        if order > self.columns.shape[1]:
            raise IdentificationError(f"the data holds {self.columns.shape[1]} states, {order} were asked for")
        observability = self.columns[:, :order]
        A = linalg.lstsq(observability[: -self.outputs], observability[self.outputs :], check_finite=False)[0]
        return A, observability[: self.outputs]


def observability_span(projection: Projection, weighting: Weighting, outputs: int) -> ObservabilitySpan:
    """Singular value decomposition of the weighted projection (eq 19).

    Raises:
        IdentificationError: nothing of the output depends on the past, as in a record at rest.
    """
    weighted = weighting(projection)
    if not weighted.matrix.size or not np.any(weighted.matrix):
        raise IdentificationError("the outputs do not depend on their past; a record with motion would do")
    U, s, _ = linalg.svd(weighted.matrix, full_matrices=False)
    kept = s > NEGLIGIBLE * s[0]
    columns = U[:, kept] * np.sqrt(s[kept])
    if weighted.unweight is not None:
        columns = weighted.unweight @ columns
    return ObservabilitySpan(columns, s[kept], outputs)
