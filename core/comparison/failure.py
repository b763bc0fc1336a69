"""Places at which a model of the isolation layer fails: windows, covariates and regions of its excess error.

`failure` finds them; `failure_sentences` describes them to engineers, in mm, mm/s and kN.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from core.comparison.compared import ForceComparison, force_misfit
from core.comparison.covariates import covariates
from core.comparison.excess import BLOCK, Blocks, Share, blocks, by_bin, shares
from core.comparison.misfit import Misfit
from core.comparison.profile import Profile, constant, over_frequency, over_motion, profile
from core.comparison.region import AS_CLEAR, Region, significant_regions, within
from core.errors import RecordError

MORE_THAN_NOISE, IN_A_BLOCK = 1.1, 2.0
"""Noise ratio up to which noise may explain everything, the noise being an estimate: over all earthquakes, and in the
worst block. A choice."""
VALUES_OFF = 0.9
"""Share of the excess error that another constant stiffness and damping must remove for the values to be wrong. A
choice."""
WORST = 5
"""Number of windows that are reported."""
SIDES: Mapping[str, tuple[str, str, float]] = MappingProxyType(
    {
        "amplitude": ("in cycles above {} mm", "in cycles below {} mm", 1e3),
        "velocity": ("above {} mm/s", "below {} mm/s", 1e3),
        "largest past displacement": (
            "after the layer has been {} mm away from the middle",
            "before the layer has been {} mm away from the middle",
            1e3,
        ),
        "travel": ("after {} m of travel in an earthquake", "in the first {} m of travel of an earthquake", 1.0),
        "cycle": ("after {} cycles of an earthquake", "in the first {} cycles of an earthquake", 1.0),
        "time": ("later than {} s into the record", "in the first {} s of the record", 1.0),
        "other direction": (
            "while the layer is more than {} mm away in the other direction",
            "while the layer is less than {} mm away in the other direction",
            1e3,
        ),
        "vertical load": (
            "while the vertical load is above {} times the weight",
            "while the vertical load is below {} times the weight",
            1.0,
        ),
        "temperature": ("above {} °C", "below {} °C", 1.0),
    }
)
"""Phrases for the two sides of a threshold, and users' units per SI unit."""
VARYING: Mapping[str, str] = MappingProxyType(
    {
        "amplitude": "amplitude",
        "velocity": "velocity",
        "largest past displacement": "largest past displacement",
        "travel": "travel",
        "cycle": "cycle",
        "time": "time",
        "other direction": "other direction",
        "vertical load": "vertical load",
        "temperature": "temperature",
        "phase": "phase of the loop",
        "earthquake": "earthquake",
    }
)
"""Names in sentences of what stiffness and damping may vary with."""
MOST_NAMED = 3
"""Largest number of regions, varying stiffnesses or windows in a sentence."""
NAMED = 0.01
"""Smallest share of the excess error for which a window is named. A choice."""
WORTH_NAMING = 0.1
"""Smallest share of the excess error that a varying stiffness must remove beyond a constant one. A choice."""


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
    samples, misfit = blocks(compared, rng), force_misfit(compared)
    observations = [one.observation for one in compared]
    motion = np.concatenate([np.column_stack([one.layer.displacement, one.layer.velocity]) for one in observations])
    each = covariates(observations)
    ratio = _noise_ratio(samples)
    is_noise = ratio.value <= MORE_THAN_NOISE and _worst(samples) <= IN_A_BLOCK
    regions = () if is_noise else significant_regions(each, samples)
    phases = next((one for one in each if one.name == "phase"), None)
    by_phase = bool(regions) and phases is not None and regions[0].name != phases.name
    return Failure(
        misfit=misfit,
        noise_ratio=ratio,
        is_noise=is_noise,
        windows=_windows(compared, samples),
        profiles=(*(profile(one, samples, motion) for one in each), over_frequency(compared, rng)),
        constant=constant(samples, motion),
        over_motion=over_motion(samples, motion),
        regions=regions,
        narrowed=within(regions[0], phases, samples) if by_phase and phases is not None else None,
    )


def _noise_ratio(samples: Blocks) -> Share:
    one = np.zeros(samples.number.size, dtype=np.intp)
    error, noise = (by_bin(values, samples, one, 1) for values in (samples.residual**2, samples.noise))
    (squared,) = shares(error, noise, samples.draws)
    return Share(*(float(np.sqrt(value)) for value in (squared.value, squared.low, squared.high)))


def _worst(samples: Blocks) -> float:
    """Noise ratio of the worst block."""
    error, noise = (np.bincount(samples.number, weights=values) for values in (samples.residual**2, samples.noise))
    return float(np.sqrt(np.max(error / noise)))


def _windows(compared: Sequence[ForceComparison], samples: Blocks) -> tuple[Window, ...]:
    excess = np.bincount(samples.number, weights=samples.excess)
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


def failure_sentences(failing: Failure) -> tuple[str, ...]:
    """Sentences, the most important first."""
    return tuple(_sentences(failing))


def _sentences(failing: Failure) -> Iterator[str]:
    share = _round(100 * failing.misfit.nrmse, 2)
    error = (
        f"The model's force is off by {_kilonewton(failing.misfit.rms)} (root mean square), {share} % of the force and "
        f"{failing.noise_ratio.value:.3g} times the noise"
    )
    if failing.is_noise:
        yield f"{error}: it cannot be distinguished from noise."
        return
    yield f"{error}."
    if failing.is_of_values:
        yield (
            f"Another constant stiffness and damping would remove {_share(failing.constant)} of the excess error: "
            "the values are wrong, and no effect need be missing. Fit the model."
        )
        return
    yield _where(failing)
    if also := [place(one) for one in failing.regions[1:] if one.odds.low * AS_CLEAR >= failing.regions[0].odds.low]:
        yield f"The records can barely distinguish this from: {'; '.join(also[:MOST_NAMED])}."
    yield from _corrections(failing)
    yield f"Largest errors: {'; '.join(_window(one) for one in failing.windows[:MOST_NAMED] if one.share >= NAMED)}."


def _where(failing: Failure) -> str:
    if not failing.regions:
        return "The excess error is not concentrated anywhere: it is distributed like the force itself."
    first, chosen = failing.regions[0], failing.narrowed or failing.regions[0]
    where = f"{place(first)}, {chosen.classed}" if failing.narrowed else place(first)
    return (
        f"{_share(chosen.share)} of the excess error lies {where}, which has {_percent(chosen.energy)} of the force's "
        "energy."
    )


def place(region: Region) -> str:
    """A region, as in `in cycles above 150 mm`."""
    if region.classed:
        return region.classed if region.name == "phase" else f"in the {region.name} of {region.classed}"
    above, below, unit = SIDES[region.name]
    return (above if region.is_above else below).format(_round(region.threshold * unit, 2))


def _corrections(failing: Failure) -> Iterator[str]:
    if failing.over_motion.value > failing.constant.value:
        yield (
            f"Another constant stiffness and damping would remove {_share(failing.constant)} of the excess error; the "
            f"best function of displacement and velocity would remove {_share(failing.over_motion)}."
        )
    else:
        yield (
            f"Another constant stiffness and damping would remove {_share(failing.constant)} of the excess error; no "
            "other function of displacement and velocity was found that removes more."
        )
    helping = [(one, one.explained_share) for one in failing.profiles if one.explained_share is not None]
    helping = [(one, away) for one, away in helping if away.low > failing.constant.value + WORTH_NAMING]
    helping.sort(key=lambda pair: -pair[1].value)
    if helping:
        shares = ", ".join(f"{_share(away)} with the {_name(one)}" for one, away in helping[:MOST_NAMED])
        yield f"Stiffness and damping that vary would explain {shares}."


def _name(one: Profile) -> str:
    return VARYING.get(one.name, one.name)


def _window(window: Window) -> str:
    return (
        f"{window.start:.0f} to {window.end:.0f} s of {window.earthquake}, direction {window.direction} "
        f"({_kilonewton(window.rms)}, {_percent(window.share)} of the excess)"
    )


def _share(share: Share) -> str:
    low, high = (min(max(100 * bound, 0.0), 100.0) for bound in (share.low, share.high))
    return f"{_percent(share.value)} ({low:.0f} to {high:.0f})"


def _percent(value: float) -> str:
    return f"{_round(100 * min(max(value, 0.0), 1.0), 2)} %"


def _kilonewton(value: float) -> str:
    return " ".join((_round(value * 1e-3, 3), "kN"))


def _round(value: float, digits: int) -> str:
    return f"{float(f'{value:.{digits}g}'):,.10g}"
