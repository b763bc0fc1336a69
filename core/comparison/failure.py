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
"""Error in multiples of the noise floor up to which noise may be all there is, the floor being an estimate: over all
earthquakes, and in the worst block."""
VALUES_OFF = 0.9
"""Of the excess error: what another constant stiffness and damping must take away for nothing to be missing."""
WORST = 5
"""Windows that are named."""


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
    """Of the excess error of all earthquakes."""


@dataclass(frozen=True, slots=True, eq=False)
class Failure:
    """Where the force of a model is off by more than noise, over all earthquakes."""

    misfit: Misfit
    noise_ratio: Share
    """Error in multiples of the noise floor, each earthquake in its own."""
    is_noise: bool
    """Whether noise may be all there is."""
    windows: tuple[Window, ...]
    """The worst, worst first."""
    profiles: tuple[Profile, ...]
    """Of every covariate that changes, and of frequency."""
    constant: Share
    """Of the excess error: what another stiffness and damping would take away."""
    over_motion: Share
    """What any function of displacement and velocity would."""
    regions: tuple[Region, ...]
    """That hold most of the excess error and stand out (region.py); none where noise may be all there is."""
    narrowed: Region | None
    """The clearest of them in the phase of the loop that holds most of it."""

    @property
    def is_of_values(self) -> bool:
        """Whether other values of stiffness and damping would do."""
        return not self.is_noise and self.constant.low >= VALUES_OFF


def failure(compared: Sequence[ForceComparison], rng: np.random.Generator) -> Failure:
    """Residual over every covariate, worst windows, and what stands out.

    Args:
        compared: forces, in order of time.
        rng: weights blocks anew for the intervals.

    Raises:
        RecordError: there is nothing to compare.
    """
    if not compared:
        raise RecordError("no earthquake has both a force and a motion of the layer; a model cannot be held against it")
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
    """Error of the worst block in multiples of its noise."""
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
