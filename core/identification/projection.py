"""LQ factorisation of the block Hankel data matrix: projection of the future outputs on the past (paper, eq 13-18)."""

from dataclasses import dataclass
from math import ceil

import numpy as np
from scipy import fft, linalg

from core.arrays import Matrix
from core.errors import IdentificationError

SMALLEST_DIAGONAL = 1e-4
"""Ratio to the largest diagonal entry of the Cholesky factor, below which the factor is discarded.

The relative rounding error of a Gram matrix grows with the inverse square of this ratio: here, to 1e-7."""
SEGMENT = 16
"""Segment length over the number of lags: shorter segments overlap more, longer ones exceed the processor's cache."""


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """Blocks of the lower triangular factor L of [U_f; W_p; Y_f] = L Q: future input, past, future output.

    Eq 16 of the paper in these terms: Y_f Π = L32 Q2 + L33 Q3 and W_p Π = L22 Q2. No N x N matrix is formed.
    """

    inputs: Matrix
    """(m, n), as given."""
    outputs: Matrix
    """(p, n), as given."""
    block_rows: int
    """r, block rows of the past, and of the future."""
    future_input: Matrix
    """L11, (rows of the future input, the same)."""
    past_input: Matrix
    """L21, (rows of the past, rows of the future input)."""
    past: Matrix
    """L22, (rows of the past, the same)."""
    future: Matrix
    """L32, (rows of the future output, rows of the past)."""
    residual: Matrix
    """L33, (rows of the future output, the same): the part that the past does not explain."""


def block_hankel(series: Matrix, block_rows: int) -> Matrix:
    """Block Hankel matrix [Y_r(1) ... Y_r(N)] (paper, eq 13 and 15).

    Args:
        series: (channels, n).
        block_rows: r, successive samples stacked in a column.

    Returns:
        (block_rows * channels, n - block_rows + 1), a copy; within a column all channels of a sample come together.
    """
    windows = np.lib.stride_tricks.sliding_window_view(series, block_rows, axis=1)
    return windows.transpose(2, 0, 1).reshape(block_rows * series.shape[0], -1)


def hankel_gram(series: Matrix, block_rows: int) -> Matrix:
    """Gram matrix H Hᵀ of the block Hankel matrix H, computed without forming H.

    The first block row consists of lag products. Along a block diagonal, the summation window advances by one sample:
    one product enters and one leaves.

    Args:
        series: (channels, n).
        block_rows: as in `block_hankel`.

    Returns:
        (block_rows * channels, the same).
    """
    channels, n = series.shape
    columns = n - block_rows + 1
    leaving, entering = series[:, : block_rows - 1].T.ravel(), series[:, columns:].T.ravel()
    change = np.outer(entering, entering) - np.outer(leaving, leaving)
    gram = np.empty((block_rows, channels, block_rows * channels))
    gram[0] = lag_products(series, block_rows).transpose(1, 0, 2).reshape(channels, -1)
    for row in range(block_rows - 1):
        now, below = slice(row * channels, (row + 1) * channels), slice((row + 1) * channels, (row + 2) * channels)
        np.add(gram[row, :, :-channels], change[now], out=gram[row + 1, :, channels:])
        gram[row + 1, :, :channels] = gram[0, :, below].T
    return gram.reshape(block_rows * channels, -1)


def lag_products(series: Matrix, lags: int) -> np.ndarray[tuple[int, int, int], np.dtype[np.float64]]:
    """Σ_t y(t) y(t + lag)ᵀ over the first n - lags + 1 samples t, by the discrete Fourier transform of short segments.

    The cross spectra of the segments are summed before a single inverse transform. Transforms of the whole record for
    all pairs of channels would dominate the computing time.

    Args:
        series: (channels, n).
        lags: number of lags, from zero.

    Returns:
        (lags, channels, channels).
    """
    channels, n = series.shape
    length = fft.next_fast_len(SEGMENT * lags, real=True)
    step = length - lags + 1  # a segment and its largest lag fill the length, so that nothing wraps around
    segments = ceil((n - lags + 1) / step)
    earlier, later = np.zeros((channels, segments * step)), np.zeros((channels, segments * step + lags - 1))
    earlier[:, : n - lags + 1], later[:, :n] = series[:, : n - lags + 1], series
    at_lag_zero = fft.rfft(earlier.reshape(channels, segments, step), length)
    at_all_lags = fft.rfft(np.lib.stride_tricks.sliding_window_view(later, length, axis=1)[:, ::step], length)
    cross = at_lag_zero.conj().transpose(2, 0, 1) @ at_all_lags.transpose(2, 1, 0)
    return np.asarray(fft.irfft(cross, length, axis=0)[:lags])


def project(inputs: Matrix, outputs: Matrix, block_rows: int) -> Projection:
    """Orthogonal projection that removes the future input and correlates with the past (paper, eq 15-18), by LQ.

    The instrumental variables Φ are the past inputs and outputs. L is the Cholesky factor of the Gram matrix if that is
    well conditioned, which sensor noise usually ensures; otherwise it comes from Householder reflections.

    Args:
        inputs: (m, n).
        outputs: (p, n), of the same scale as the inputs within a few orders of magnitude.
        block_rows: r, block rows of the past, and of the future.

    Raises:
        IdentificationError: the record is too short for that many block rows.
    """
    m, (p, n) = inputs.shape[0], outputs.shape
    rows = 2 * block_rows * (m + p)
    if n - 2 * block_rows + 1 < rows:
        raise IdentificationError(
            f"{n} samples are too few for {block_rows} block rows of {m} inputs and {p} outputs; "
            f"at least {rows + 2 * block_rows - 1} samples, or fewer block rows, are needed"
        )
    L = lq_by_cholesky(inputs, outputs, block_rows)
    if L is None:
        L = lq_by_householder(inputs, outputs, block_rows)
    a, b = block_rows * m, block_rows * (2 * m + p)
    return Projection(
        inputs=inputs,
        outputs=outputs,
        block_rows=block_rows,
        future_input=L[:a, :a],
        past_input=L[a:b, :a],
        past=L[a:b, a:b],
        future=L[b:, a:b],
        residual=L[b:, b:],
    )


def lq_by_cholesky(inputs: Matrix, outputs: Matrix, block_rows: int) -> Matrix | None:
    """L of [U_f; W_p; Y_f] = L Q from its Gram matrix; None if that is too near to singular."""
    m, p = len(inputs), len(outputs)
    rows = np.arange(2 * block_rows * (m + p)).reshape(2 * block_rows, m + p)
    U, Y = rows[:, :m].ravel(), rows[:, m:].ravel()
    order = np.concatenate([U[block_rows * m :], U[: block_rows * m], Y])
    gram = hankel_gram(np.vstack([inputs, outputs]), 2 * block_rows).take(order, axis=0).take(order, axis=1)
    try:
        L: Matrix = linalg.cholesky(gram, lower=True, overwrite_a=True, check_finite=False)
    except linalg.LinAlgError:
        return None
    diagonal = np.diag(L)
    return L if diagonal.min() > SMALLEST_DIAGONAL * diagonal.max() else None


def lq_by_householder(inputs: Matrix, outputs: Matrix, block_rows: int) -> Matrix:
    """L of [U_f; W_p; Y_f] = L Q by QR in batches; memory does not grow with the length of the record."""
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
    return R.T
