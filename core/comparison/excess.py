"""Error of a model beyond the noise: its share in any part of the records, and what a correction explains of it.

Every earthquake's error counts in units of its own noise, so that a weak one informs on small motion as a strong one
does on large motion. Errors of neighbouring samples are correlated, so that
intervals come from reweighting whole blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Matrix, Vector
from core.comparison.compared import ForceComparison

BLOCK = 5.0
"""s, length of a block. A choice."""
DRAWS = 400
"""Bootstrap draws of the blocks. Not tuned: the ends of an interval vary by a few percent of its length."""
INTERVAL = (2.5, 97.5)
"""%, quantiles of the draws: 95 % lie between."""


@dataclass(frozen=True, slots=True)
class Share:
    """A part of a whole, with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Error, noise and force at the samples of all earthquakes, in blocks."""

    number: Indices
    """(n,) index of each sample's block."""
    weight: Vector
    """(n,) 1/N, weight: one over the root mean square noise of the sample's earthquake."""
    residual: Vector
    """(n,) estimated − model, weighted."""
    noise: Vector
    """(n,) its variance if the model is correct: 1 on average."""
    energy: Vector
    """(n,) square of the estimated force, weighted: where an error in proportion to the force would lie."""
    draws: Matrix
    """(draws, blocks) weight of each block."""

    @property
    def excess(self) -> Vector:
        """(n,) squared error less the noise's variance."""
        return np.asarray(self.residual**2 - self.noise)

    @property
    def count(self) -> int:
        """Number of blocks."""
        return self.draws.shape[1]


def blocks(compared: Sequence[ForceComparison], rng: np.random.Generator) -> Blocks:
    """Blocks of BLOCK seconds, none across two earthquakes.

    Args:
        compared: forces, in order of time.
        rng: draws the blocks' weights.
    """
    lengths = [round(BLOCK * one.observation.rate) for one in compared]
    counts = [-(-one.model.size // length) for one, length in zip(compared, lengths, strict=True)]
    first = np.cumsum([0, *counts])
    numbers = [
        at + np.arange(one.model.size) // length for one, length, at in zip(compared, lengths, first, strict=False)
    ]
    weight = np.concatenate([np.full(one.model.size, 1 / one.noise.rms) for one in compared])
    return Blocks(
        number=np.concatenate(numbers).astype(np.intp),
        weight=weight,
        residual=np.concatenate([one.residual * _part_with_known_noise(one) for one in compared]) * weight,
        noise=(np.concatenate([one.noise.std for one in compared]) * weight) ** 2,
        energy=(np.concatenate([one.observation.layer.force for one in compared]) * weight) ** 2,
        draws=drawn(int(first[-1]), rng),
    )


def _part_with_known_noise(one: ForceComparison) -> float:
    """Root mean square of the part of a residual whose noise is known, over that of all of it.

    The whole residual shows at which samples a model fails: its filtered part rings into the samples beside them.
    """
    whole = float(np.sqrt(np.mean(one.residual**2)))
    return float(np.sqrt(np.mean(one.resolved**2))) / whole if whole > 0 else 1.0


def drawn(count: int, rng: np.random.Generator) -> Matrix:
    """(draws, count) weight of each block in every draw, 1 on average (Rubin 1981).

    No weight is zero: often a few blocks hold all the information, and a draw needs them.
    """
    return np.asarray(rng.standard_exponential((DRAWS, count)))


def by_bin(values: Vector, samples: Blocks, bins: Indices, count: int) -> Matrix:
    """(blocks, count) sums of a (n,) series over blocks and bins."""
    sums = np.bincount(samples.number * count + bins, weights=values, minlength=samples.count * count)
    return np.asarray(sums.reshape(samples.count, count), dtype=float)


def ratio(part: Matrix, whole: Matrix, draws: Matrix) -> tuple[Vector, Matrix]:
    """(k,) ratios of the sums over all blocks, and (draws, k) the same of each draw.

    Args:
        part: (blocks, k).
        whole: (blocks, 1) or (blocks, k).
        draws: (draws, blocks).
    """
    return np.asarray(part.sum(axis=0) / whole.sum(axis=0)), np.asarray((draws @ part) / (draws @ whole))


def shares(part: Matrix, whole: Matrix, draws: Matrix) -> tuple[Share, ...]:
    """(k,) ratios of the sums with their intervals; arguments as those of `ratio`."""
    values, drawn = ratio(part, whole, draws)
    low, high = np.percentile(drawn, INTERVAL, axis=0)
    return tuple(Share(*map(float, each)) for each in zip(values, low, high, strict=True))


FOLDS = 5
"""Folds of the cross-validation. A choice."""
SHRINKAGE = 1e-3
"""Shrinkage of a bin's coefficients towards zero, as a share of a bin's mean weight, for rare bins. A choice."""


def explained_share(regressors: Matrix, bins: Indices, count: int, samples: Blocks) -> Share:
    """Share of the excess error that a separate regression in every bin removes from blocks it was not fitted to.

    Args:
        regressors: (n, p), such as displacement and velocity.
        bins: (n,) bin of each sample.
        count: of bins.
        samples: the error.
    """
    weighted = regressors * samples.weight[:, None]
    gain = _gain(weighted / np.sqrt(np.mean(weighted**2, axis=0)), bins, count, samples)
    one = np.zeros(bins.size, dtype=np.intp)
    return shares(gain[:, None], by_bin(samples.excess, samples, one, 1), samples.draws)[0]


def _gain(regressors: Matrix, bins: Indices, count: int, samples: Blocks) -> Vector:
    """(blocks,) decrease of the sum of squares in each block, by a fit to the other folds."""
    size = regressors.shape[1]
    products = [by_bin(one * other, samples, bins, count) for one in regressors.T for other in regressors.T]
    normal = np.stack(products, axis=-1).reshape(samples.count, count, size, size)
    load = np.stack([by_bin(one * samples.residual, samples, bins, count) for one in regressors.T], axis=-1)
    ridge = SHRINKAGE * np.trace(normal.sum(axis=(0, 1))) / (count * size) * np.eye(size)
    fold = np.arange(samples.count) % FOLDS
    gain = np.zeros(samples.count)
    for number in range(min(FOLDS, samples.count)):
        fitted, held_out = fold != number, fold == number
        coefficients = np.linalg.solve(normal[fitted].sum(axis=0) + ridge, load[fitted].sum(axis=0)[..., None])[..., 0]
        linear = np.einsum("bcp,cp->b", load[held_out], coefficients)
        square = np.einsum("bcpq,cp,cq->b", normal[held_out], coefficients, coefficients)
        gain[held_out] = 2 * linear - square
    return gain
