"""Input-output subspace identification: a state-space model from what was measured (paper, eq 11-12, 16-19)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import IdentificationError
from core.identification.projection import Projection

NEGLIGIBLE = 1e-10
"""Share of the largest singular value below which a direction is rounding, not data."""


@dataclass(frozen=True, slots=True, eq=False)
class Weighted:
    """W1 L32 W2, whose singular value decomposition is taken; a weighting that is None is the unit matrix."""

    matrix: Matrix
    row_weighting: Matrix | None = None
    """W1."""
    row_unweighting: Matrix | None = None
    """Left inverse of W1 on the range of L32."""
    column_weighting: Matrix | None = None
    """W2."""


Weighting = Callable[[Projection], Weighted]


def moesp(projection: Projection) -> Weighted:
    """Verhaegen (1994): rows as they are, columns Y_f Π Φᵀ(ΦΠΦᵀ)⁻¹ΦΠ."""
    return Weighted(projection.future)


def n4sid(projection: Projection) -> Weighted:
    """Van Overschee and De Moor (1994): the oblique projection of the future output on the past, Y_f Π Φᵀ(ΦΠΦᵀ)⁻¹Φ."""
    W2 = linalg.pinv(projection.past, rtol=NEGLIGIBLE) @ np.hstack([projection.past_input, projection.past])
    return Weighted(projection.future @ W2, column_weighting=W2)


def cva(projection: Projection) -> Weighted:
    """Larimore (1990): canonical correlations, rows weighted by (Y_f Π Y_fᵀ)^(-1/2)."""
    U, s, _ = linalg.svd(np.hstack([projection.future, projection.unexplained]), full_matrices=False)
    kept = s > NEGLIGIBLE * s[0]
    U, s = U[:, kept], s[kept]
    W1 = (U / s).T
    return Weighted(W1 @ projection.future, row_weighting=W1, row_unweighting=U * s)


WEIGHTINGS: Mapping[str, Weighting] = MappingProxyType({"n4sid": n4sid, "moesp": moesp, "cva": cva})
"""The classical choices of the two weighting matrices (Ljung 1999, table 10.1)."""


def is_identifiable(*, outputs: int, inputs: int, references: int, regulators: int = 1) -> bool:
    """The necessary condition for identifying the plant of a closed loop, r ≥ (n_y + n_u)/(n_y + n_r) (eq 11).

    For a superstructure above its isolation layer the slab's acceleration is the input and the ground's the reference.
    """
    return regulators * (outputs + references) >= outputs + inputs


@dataclass(frozen=True, slots=True, eq=False)
class ObservabilitySpan:
    """The extended observability matrix, its columns ordered by how much of the data each carries (eq 19)."""

    projection: Projection
    columns: Matrix
    """(block_rows * outputs, k) U_1 S_1^(1/2), the row weighting taken back."""
    singular_values: Vector
    """(k,)"""
    left_inverse: Matrix
    """(k, block_rows * outputs): times the columns, the unit matrix."""
    combination: Matrix
    """(rows of the past, k): the columns are L32 times this."""

    def system(self, order: int) -> tuple[Matrix, Matrix]:
        """A (order, order) by shift invariance and C (outputs, order), the first block row.

        Raises:
            IdentificationError: the data does not hold that many states.
        """
        if order > self.columns.shape[1]:
            raise IdentificationError(f"the data holds {self.columns.shape[1]} states, {order} were asked for")
        observability, p = self.columns[:, :order], len(self.projection.outputs)
        A = linalg.lstsq(observability[:-p], observability[p:], check_finite=False)[0]
        return A, observability[:p]


def observability_span(projection: Projection, weighting: Weighting) -> ObservabilitySpan:
    """Singular value decomposition of the weighted projection (eq 19).

    Raises:
        IdentificationError: nothing of the output depends on the past, as in a record at rest.
    """
    weighted = weighting(projection)
    if not weighted.matrix.size or not np.any(weighted.matrix):
        raise IdentificationError("the outputs do not depend on their past; a record with motion would do")
    U, s, Vt = linalg.svd(weighted.matrix, full_matrices=False)
    kept = s > NEGLIGIBLE * s[0]
    root = np.sqrt(s[kept])
    columns, left_inverse, combination = U[:, kept] * root, (U[:, kept] / root).T, Vt[kept].T / root
    if weighted.row_weighting is not None and weighted.row_unweighting is not None:
        columns, left_inverse = weighted.row_unweighting @ columns, left_inverse @ weighted.row_weighting
    if weighted.column_weighting is not None:
        combination = weighted.column_weighting @ combination
    return ObservabilitySpan(projection, columns, s[kept], left_inverse, combination)
