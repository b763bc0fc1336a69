"""Places at which a model of the isolation layer fails: windows, covariates and regions of its excess error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.comparison.compared import ForceComparison, force_misfit
from core.comparison.covariates import covariates
from core.comparison.excess import BLOCK, Blocks, Share, blocks, by_bin, shares
from core.comparison.misfit import Misfit
from core.comparison.profile import Profile, constant, over_frequency, over_motion, profile
from core.comparison.region import Region, significant_regions, within
from core.errors import RecordError

MORE_THAN_NOISE, IN_A_BLOCK = 1.1, 2.0
"""Noise ratio up to which noise may explain everything, the noise being an estimate: over all
earthquakes, and in the worst block."""
VALUES_OFF = 0.9
"""Share of the excess error that another constant stiffness and damping must remove for the values to be wrong."""
WORST = 5
"""Number of windows that are reported."""


@dataclass(frozen=True, slots=True)
class Window:
    """A block of a record."""

    earthquake: str
    direction: str
    start: float
    """s after the record's start."""
    end: float
    """s."""
    rms: float
    """N, of the residual."""
    share: float
    """Share of the excess error of all earthquakes."""


@dataclass(frozen=True, slots=True, eq=False)
class Failure:
    """Places where a model's force is wrong by more than noise, over all earthquakes."""

    misfit: Misfit
    noise_ratio: Share
    """Noise ratio, each earthquake by its own noise."""
    is_noise: bool
    """True if noise may explain the whole error."""
    windows: tuple[Window, ...]
    """Blocks with the largest error, the largest first."""
    profiles: tuple[Profile, ...]
    """Profiles over every covariate that changes, and over frequency."""
    constant: Share
    """Share of the excess error that another constant stiffness and damping would remove."""
    over_motion: Share
    """Share that the best function of displacement and velocity would remove."""
    regions: tuple[Region, ...]
    """Regions with most of the excess error (region.py); none where noise may explain everything."""
    narrowed: Region | None
    """The clearest region, narrowed to the phase of the loop with most of the error."""

    @property
    def is_of_values(self) -> bool:
        """True if other constant values of stiffness and damping explain the excess error."""
        return not self.is_noise and self.constant.low >= VALUES_OFF


def failure(compared: Sequence[ForceComparison], rng: np.random.Generator) -> Failure:
    """Residual over every covariate, largest windows, and regions of excess error.

    Args:
        compared: forces, in order of time.
        rng: weights blocks anew for the intervals.

    Raises:
        RecordError: there is nothing to compare.
    """
    if not compared:
        raise RecordError("no earthquake has both a force and a motion of the layer; the model cannot be compared")
    found, misfit = blocks(compared, rng), force_misfit(compared)
    observations = [one.observation for one in compared]
    motion = np.concatenate([np.column_stack([one.layer.displacement, one.layer.velocity]) for one in observations])
    each = covariates(observations)
    ratio = _noise_ratio(found)
    is_noise = ratio.value <= MORE_THAN_NOISE and _worst(found) <= IN_A_BLOCK
    regions = () if is_noise else significant_regions(each, found)
    phases = next((one for one in each if one.name == "phase"), None)
    by_phase = bool(regions) and phases is not None and regions[0].name != phases.name
    return Failure(
        misfit=misfit,
        noise_ratio=ratio,
        is_noise=is_noise,
        windows=_windows(compared, found),
        profiles=(*(profile(one, found, motion) for one in each), over_frequency(compared, rng)),
        constant=constant(found, motion),
        over_motion=over_motion(found, motion),
        regions=regions,
        narrowed=within(regions[0], phases, found) if by_phase and phases is not None else None,
    )


def _noise_ratio(found: Blocks) -> Share:
    one = np.zeros(found.number.size, dtype=np.intp)
    error, noise = (by_bin(values, found, one, 1) for values in (found.residual**2, found.noise))
    (squared,) = shares(error, noise, found.draws)
    return Share(*(float(np.sqrt(value)) for value in (squared.value, squared.low, squared.high)))


def _worst(found: Blocks) -> float:
    """Noise ratio of the worst block."""
    error, noise = (np.bincount(found.number, weights=values) for values in (found.residual**2, found.noise))
    return float(np.sqrt(np.max(error / noise)))


def _windows(compared: Sequence[ForceComparison], found: Blocks) -> tuple[Window, ...]:
    excess = np.bincount(found.number, weights=found.excess)
    places = [
        (one, first, min(first + length, one.model.size))
        for one in compared
        for length in (round(BLOCK * one.observation.rate),)
        for first in range(0, one.model.size, length)
    ]
    worst = np.argsort(excess)[::-1][:WORST]
    total = excess.sum()
    return tuple(
        Window(
            earthquake=one.observation.name,
            direction=one.observation.direction,
            start=first / one.observation.rate,
            end=last / one.observation.rate,
            rms=float(np.sqrt(np.mean(one.residual[first:last] ** 2))),
            share=float(excess[at] / total) if total > 0 else 0.0,
        )
        for at in worst.tolist()
        for one, first, last in (places[at],)
    )
