"""How much of a model's error would a stiffness and a damping that vary with a covariate take away?"""

import numpy as np

from core.arrays import Indices, Matrix, Vector
from core.comparison.excess import Blocks, Share, by_bin, shares

FOLDS = 5
"""Of a cross-validation: every fifth block is told from the others."""
SHRINKAGE = 1e-3
"""Of a bin's coefficients towards none, in the mean weight of a bin: one that hardly occurs is not told of."""


def taken_away(regressors: Matrix, bins: Indices, count: int, found: Blocks) -> Share:
    """Share of the excess error that a regression of its own in every bin takes away, on blocks it was not fitted to.

    Args:
        regressors: (n, p), such as displacement and velocity.
        bins: (n,) bin of each sample.
        count: of bins.
        found: the error.
    """
    weighted = regressors * found.weight[:, None]
    gain = _gain(weighted / np.sqrt(np.mean(weighted**2, axis=0)), bins, count, found)
    one = np.zeros(bins.size, dtype=np.intp)
    return shares(gain[:, None], by_bin(found.excess, found, one, 1), found.draws)[0]


def _gain(regressors: Matrix, bins: Indices, count: int, found: Blocks) -> Vector:
    """(blocks,) by how much the sum of squares falls in each block."""
    size = regressors.shape[1]
    products = [by_bin(one * other, found, bins, count) for one in regressors.T for other in regressors.T]
    normal = np.stack(products, axis=-1).reshape(found.count, count, size, size)
    load = np.stack([by_bin(one * found.residual, found, bins, count) for one in regressors.T], axis=-1)
    ridge = SHRINKAGE * np.trace(normal.sum(axis=(0, 1))) / (count * size) * np.eye(size)
    fold = np.arange(found.count) % FOLDS
    gain = np.zeros(found.count)
    for left_out in range(min(FOLDS, found.count)):
        fitted, told = fold != left_out, fold == left_out
        coefficients = np.linalg.solve(normal[fitted].sum(axis=0) + ridge, load[fitted].sum(axis=0)[..., None])[..., 0]
        linear = np.einsum("bcp,cp->b", load[told], coefficients)
        square = np.einsum("bcpq,cp,cq->b", normal[told], coefficients, coefficients)
        gain[told] = 2 * linear - square
    return gain
