import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.errors import IdentificationError
from core.identification.projection import (
    block_hankel,
    hankel_gram,
    lq_by_cholesky,
    lq_by_householder,
    project,
)


def test_hankel_holds_the_samples_one_below_the_other() -> None:
    assert block_hankel(np.array([[1, 2, 3, 4], [5, 6, 7, 8]]), 2).tolist() == [
        [1, 2, 3],
        [5, 6, 7],
        [2, 3, 4],
        [6, 7, 8],
    ]


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), channels=st.integers(1, 4), block_rows=st.integers(1, 8))
def test_gram_is_that_of_the_hankel_matrix(seed: int, channels: int, block_rows: int) -> None:
    series = np.random.default_rng(seed).standard_normal((channels, 50))
    hankel = block_hankel(series, block_rows)
    # Sums of 50 products of order one: rounding stays far below this.
    assert hankel_gram(series, block_rows) == pytest.approx(hankel @ hankel.T, abs=1e-11)


def test_both_ways_give_the_same_triangle() -> None:
    rng = np.random.default_rng(6)
    u, y = rng.standard_normal((1, 3000)), rng.standard_normal((2, 3000))
    by_gram, by_data = lq_by_cholesky(u, y, 8), lq_by_householder(u, y, 8)
    assert by_gram is not None
    assert by_gram == pytest.approx(by_data * np.sign(np.diag(by_data)), abs=1e-9 * np.abs(by_data).max())


def test_the_gram_matrix_is_not_trusted_where_noise_is_missing() -> None:
    """An output that follows the input exactly: half the digits would be lost in squaring."""
    u = np.random.default_rng(8).standard_normal((1, 1000))
    assert lq_by_cholesky(u, 2 * u, 5) is None
    assert lq_by_cholesky(u, 2 * u + 1e-7 * np.roll(u[:, ::-1], 3), 5) is None


def test_batches_give_the_projection_of_one_piece() -> None:
    """L Lᵀ is the Gram matrix of the data equation's rows, however the columns were cut."""
    rng = np.random.default_rng(7)
    u, y, r = rng.standard_normal((1, 2000)), rng.standard_normal((2, 2000)), 6
    H_u, H_y = block_hankel(u, 2 * r), block_hankel(y, 2 * r)
    rows = np.vstack([H_u[r:], H_u[:r], H_y])
    L = lq_by_householder(u, y, r)
    assert pytest.approx(rows @ rows.T, rel=1e-9, abs=1e-8) == L @ L.T


def test_projection_removes_the_future_input() -> None:
    """Eq 16: Y_f Π W_pᵀ and W_p Π W_pᵀ, by the projector itself."""
    rng = np.random.default_rng(9)
    u, y, r = rng.standard_normal((1, 700)), rng.standard_normal((2, 700)), 6
    H_u, H_y = block_hankel(u, 2 * r), block_hankel(y, 2 * r)
    W, U, Y = np.vstack([H_u[:r], H_y[: 2 * r]]), H_u[r:], H_y[2 * r :]
    without = lambda M: M - (M @ U.T) @ np.linalg.solve(U @ U.T, U)  # noqa: E731
    projection = project(u, y, r)
    assert projection.future @ projection.past.T == pytest.approx(without(Y) @ W.T, rel=1e-9, abs=1e-8)
    assert projection.past @ projection.past.T == pytest.approx(without(W) @ W.T, rel=1e-9, abs=1e-8)


def test_refuses_a_record_too_short() -> None:
    with pytest.raises(IdentificationError, match="100 samples are too few for 30 block rows"):
        project(np.zeros((1, 100)), np.zeros((2, 100)), 30)
