"""Regions in which a model's excess error is more concentrated than the force itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Mask, Matrix, Vector
from core.comparison.covariates import Covariate
from core.comparison.excess import INTERVAL, Blocks, Share, by_bin, ratio, shares

THRESHOLDS = 48
"""Thresholds that are tried on a covariate. A choice."""
DIGITS = 2
"""Significant digits of a threshold: engineers use round numbers."""
MOST = 0.6
"""Smallest share of the excess error for which a region is reported. A choice."""
CLEAR_ODDS = 3.0
"""Odds of the excess error to lie in a region over those of the force's energy: the least, interval included. A
choice."""
CERTAIN = 0.03
"""Smallest distance of a share from 0 or 1 that records can resolve. A choice."""
AS_CLEAR = 3.0
"""Ratio of the odds of two regions from which on records can distinguish them. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """Part of the samples, by one covariate."""

    name: str
    """Name of the covariate."""
    threshold: float
    """SI units; of a class, its index."""
    is_above: bool
    """Above the threshold, or below; of a class, true."""
    inside: Mask
    """(n,) samples of the region."""
    share: Share
    """Share of the excess error."""
    energy: float
    """Share of the force's energy."""
    odds: Share
    """Odds of the excess error to lie here, over those of the force's energy."""
    classed: str = ""
    """Name of the class, of a covariate that is no number."""


def significant_regions(covariates: Sequence[Covariate], samples: Blocks) -> tuple[Region, ...]:
    """Regions with most of the excess error, more than their share of the force; at most one for each covariate.

    Regions that cannot be distinguished from the clearest come first, in the covariates' order.

    Args:
        covariates: at every sample, in order of importance.
        samples: the error.
    """
    regions = [region for one in covariates if (region := _clearest(one, samples)) is not None]
    clearest = max((region.odds.low for region in regions), default=0.0)
    return tuple(sorted(regions, key=lambda region: region.odds.low * AS_CLEAR < clearest))


def within(region: Region, phases: Covariate, samples: Blocks) -> Region | None:
    """The class of another covariate with most of a region's error, as part of the whole excess error."""
    part = Blocks(
        number=samples.number[region.inside],
        weight=samples.weight[region.inside],
        residual=samples.residual[region.inside],
        noise=samples.noise[region.inside],
        energy=samples.energy[region.inside],
        draws=samples.draws,
    )
    narrowed = Covariate(phases.name, phases.values[region.inside], phases.classes)
    clearest = _clearest(narrowed, part)
    if clearest is None:
        return None
    both = region.inside & (phases.values == clearest.threshold)
    return _region(phases, clearest.threshold, both, samples, is_above=True)


def _clearest(covariate: Covariate, samples: Blocks) -> Region | None:
    candidates = _classes(covariate, samples) if covariate.classes else _sides(covariate, samples)
    clear = [one for one in candidates if one.share.value >= MOST and one.odds.low >= CLEAR_ODDS]
    return max(clear, key=lambda one: one.odds.low, default=None)


def _classes(covariate: Covariate, samples: Blocks) -> list[Region]:
    present = np.unique(covariate.values)
    return [_region(covariate, float(at), covariate.values == at, samples, is_above=True) for at in present]


def _sides(covariate: Covariate, samples: Blocks) -> list[Region]:
    """Above and below the thresholds at which excess error and energy differ most."""
    values = covariate.values
    tried = _thresholds(values, samples.energy)
    if not tried.size:
        return []
    bins: Indices = np.searchsorted(tried, values, side="right").astype(np.intp)
    above = [
        np.cumsum(by_bin(series, samples, bins, tried.size + 1).sum(axis=0)[::-1])[::-1][1:]
        for series in (samples.excess, samples.energy)
    ]
    apart = np.log(_odds(above[0] / samples.excess.sum()) / _odds(above[1] / samples.energy.sum()))
    regions = []
    for at, is_above in ((int(np.argmax(apart)), True), (int(np.argmin(apart)), False)):
        inside = (values >= tried[at]) == is_above
        regions.append(_region(covariate, float(tried[at]), inside, samples, is_above=is_above))
    return regions


def _thresholds(values: Vector, energy: Vector) -> Vector:
    """Round numbers inside the range, each halfway between a quantile of the samples' energy and the value before it.

    A covariate may take few values, as an amplitude does, one a half cycle: a number rounded up from one of them
    would leave out the very samples that it rounds.
    """
    order = np.argsort(values)
    reached = np.cumsum(energy[order])
    quantiles = values[order][np.searchsorted(reached, reached[-1] * np.arange(1, THRESHOLDS) / THRESHOLDS)]
    distinct = np.unique(values)
    before = distinct[np.maximum(np.searchsorted(distinct, quantiles) - 1, 0)]
    rounded = np.unique([float(f"{value:.{DIGITS}g}") for value in (quantiles + before) / 2])
    return np.asarray(rounded[(rounded > values.min()) & (rounded < values.max())])


def _region(covariate: Covariate, threshold: float, inside: Mask, samples: Blocks, *, is_above: bool) -> Region:
    bins = inside.astype(np.intp)
    excess, energy = by_bin(samples.excess, samples, bins, 2), by_bin(samples.energy, samples, bins, 2)
    whole, force = excess.sum(axis=1, keepdims=True), energy.sum(axis=1, keepdims=True)
    share, drawn = ratio(excess[:, 1:], whole, samples.draws)
    energy_share, energy_drawn = ratio(energy[:, 1:], force, samples.draws)
    odds = _odds(share) / _odds(energy_share)
    low, high = np.percentile(_odds(drawn) / _odds(energy_drawn), INTERVAL)
    return Region(
        name=covariate.name,
        threshold=threshold,
        is_above=is_above,
        inside=inside,
        share=shares(excess[:, 1:], whole, samples.draws)[0],
        energy=float(energy_share[0]),
        odds=Share(float(odds[0]), float(low), float(high)),
        classed=covariate.classes[int(threshold)] if covariate.classes else "",
    )


def _odds(share: Vector | Matrix) -> Vector | Matrix:
    certain = np.clip(share, CERTAIN, 1 - CERTAIN)
    return np.asarray(certain / (1 - certain))
