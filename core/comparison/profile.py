"""Distribution of a model's excess error over one covariate, or over frequency."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from core.arrays import Indices, Matrix, Tensor, Vector
from core.comparison.compared import ForceComparison
from core.comparison.covariates import Covariate
from core.comparison.excess import Blocks, Share, by_bin, drawn, explained_share, shares

BINS = 8
"""Bins of a numerical covariate, each with the same share of the force's energy. A choice."""
GRID = 9
"""Cells along each of displacement and velocity. A choice."""
WINDOW = 10.0
"""s, of a spectrum. A choice."""
OCTAVES = (0.0, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8)
"""Hz, where bands of frequency begin. A choice."""


@dataclass(frozen=True, slots=True)
class Bin:
    """One part of a covariate's range."""

    low: float
    """SI units; of a class, its index."""
    high: float
    share: Share
    """Share of the excess error."""
    energy: float
    """Share of the estimated force's energy: that of an error in proportion to the force."""
    time: float
    """Share of the samples."""
    noise_ratio: float
    """Root mean square error over the one that noise alone makes."""


@dataclass(frozen=True, slots=True)
class Profile:
    """The excess error over one covariate."""

    name: str
    bins: tuple[Bin, ...]
    explained_share: Share | None
    """Share of the excess error that a separate stiffness and damping in every bin would remove, on blocks of
    the record they were not fitted to; None of a frequency."""
    classes: tuple[str, ...] = ()
    """Names of the bins, of a covariate that is no number."""


def profile(covariate: Covariate, samples: Blocks, motion: Matrix) -> Profile:
    """Profile over one covariate.

    Args:
        covariate: at every sample.
        samples: the error.
        motion: (n, 2) displacement and velocity.
    """
    edges = _edges(covariate, samples.energy)
    bins = np.clip(np.searchsorted(edges, covariate.values, side="right") - 1, 0, edges.size - 2).astype(np.intp)
    count = edges.size - 1
    away = explained_share(motion, bins, count, samples)
    return Profile(covariate.name, _bins(edges, bins, samples), away, covariate.classes)


def constant(samples: Blocks, motion: Matrix) -> Share:
    """Share of the excess error that another constant stiffness and damping would remove."""
    return explained_share(motion, np.zeros(samples.number.size, dtype=np.intp), 1, samples)


def over_motion(samples: Blocks, motion: Matrix) -> Share:
    """Share of the excess error that the best function of displacement and velocity would remove: a plane in each of
    GRID by GRID cells."""
    scaled = motion / np.abs(motion).max(axis=0)
    cells = np.clip(((scaled + 1) / 2 * GRID).astype(np.intp), 0, GRID - 1)
    plane = np.column_stack([np.ones(scaled.shape[0]), scaled])
    return explained_share(plane, np.asarray(cells[:, 0] * GRID + cells[:, 1]), GRID**2, samples)


def _edges(covariate: Covariate, energy: Vector) -> Vector:
    """(bins + 1,) rising; each bin holds the same energy, or one of a few values."""
    values = covariate.values
    distinct = np.unique(values)
    if distinct.size <= BINS:
        return np.append(distinct, np.nextafter(distinct[-1], np.inf))
    order = np.argsort(values)
    reached = np.cumsum(energy[order])
    inner = values[order][np.searchsorted(reached, reached[-1] * np.arange(1, BINS) / BINS)]
    return np.unique([values.min(), *inner, np.nextafter(values.max(), np.inf)])


def _bins(edges: Vector, bins: Indices, samples: Blocks) -> tuple[Bin, ...]:
    count = edges.size - 1
    excess = by_bin(samples.excess, samples, bins, count)
    each = shares(excess, excess.sum(axis=1, keepdims=True), samples.draws)
    energy, noise, error = (
        by_bin(values, samples, bins, count).sum(axis=0)
        for values in (samples.energy, samples.noise, samples.residual**2)
    )
    time = np.bincount(bins, minlength=count) / bins.size
    ratios = np.sqrt(error / np.where(noise > 0, noise, np.nan))
    rows = zip(edges[:-1], edges[1:], each, energy / energy.sum(), time, ratios, strict=True)
    return tuple(Bin(float(a), float(b), s, float(e), float(t), float(f)) for a, b, s, e, t, f in rows)


def over_frequency(compared: Sequence[ForceComparison], rng: np.random.Generator) -> Profile:
    """Profile over the residual's frequency, by octaves of the band in which the noise is known.

    Args:
        compared: forces.
        rng: draws the windows' weights.
    """
    known = [one.noise.whitening.frequency for one in compared]
    low, high = min(float(one[0]) for one in known), max(float(one[-1]) for one in known)
    ends = [*(f for f in OCTAVES if f < high), high]
    edges = np.array([*(first for first, end in pairwise(ends) if end > low), high])
    sums = np.concatenate([_by_octave(one, edges) for one in compared], axis=0)
    error, noise, force = np.moveaxis(sums, 2, 0)
    excess = error - noise
    each = shares(excess, excess.sum(axis=1, keepdims=True), drawn(len(excess), rng))
    energy = force.sum(axis=0) / force.sum()
    ratios = np.sqrt(error.sum(axis=0) / noise.sum(axis=0))
    rows = zip(edges[:-1], edges[1:], each, energy, ratios, strict=True)
    bins = tuple(Bin(float(a), float(b), s, float(e), 1.0, float(f)) for a, b, s, e, f in rows)
    return Profile("frequency", bins, None)


def _by_octave(one: ForceComparison, edges: Vector) -> Tensor:
    """(windows, octaves, 3) of residual, noise and force, squared and weighted."""
    rate, noise = one.observation.rate, one.noise
    length = min(round(WINDOW * rate), one.model.size)
    settings = {"fs": rate, "nperseg": length, "noverlap": length // 2, "detrend": False}
    frequency, _, error = scipy.signal.spectrogram(one.resolved / noise.rms, **settings)
    force = scipy.signal.spectrogram(one.observation.layer.force / noise.rms, **settings)[2]
    octave = np.searchsorted(edges, frequency, side="right") - 1
    within = [octave == number for number in range(edges.size - 1)]
    parts = np.histogram(noise.whitening.frequency, edges, weights=noise.whitening.std**2)[0]
    return np.stack(
        [
            np.array([error[rows].sum(axis=0) * frequency[1] for rows in within]).T,
            np.tile(parts / parts.sum(), (error.shape[1], 1)),
            np.array([force[rows].sum(axis=0) * frequency[1] for rows in within]).T,
        ],
        axis=-1,
    )
