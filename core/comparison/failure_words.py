"""Sentences for engineers about the places where a model fails: mm, mm/s, kN."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from core.comparison.excess import Share
from core.comparison.failure import Failure, Window
from core.comparison.profile import Profile
from core.comparison.region import AS_CLEAR, Region

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
TOLD = 3
"""Largest number of regions, varying stiffnesses or windows in a sentence."""
NAMED = 0.01
"""Smallest share of the excess error for which a window is named."""
WORTH = 0.1
"""Smallest share of the excess error that a varying stiffness must remove beyond a constant one."""


def words(found: Failure) -> tuple[str, ...]:
    """Sentences, the most important first."""
    return tuple(_sentences(found))


def _sentences(found: Failure) -> Iterator[str]:
    size = f"{_kilonewton(found.misfit.rms)} (root mean square), {_round(100 * found.misfit.nrmse, 2)} % of the force"
    ratio = f"{found.noise_ratio.value:.3g} times the noise"
    error = f"The model's force is off by {size}"
    if found.is_noise:
        yield f"{error} and {ratio}: it cannot be distinguished from noise."
        return
    yield f"{error} and {ratio}."
    if found.is_of_values:
        yield (
            f"Another constant stiffness and damping would remove {_share(found.constant)} of the excess error: "
            "the values are wrong, and no effect need be missing. Fit the model."
        )
        return
    yield _where(found)
    if also := [place(one) for one in found.regions[1:] if one.odds.low * AS_CLEAR >= found.regions[0].odds.low]:
        yield f"The records can barely distinguish this from: {'; '.join(also[:TOLD])}."
    yield from _corrections(found)
    yield f"Largest errors: {'; '.join(_window(one) for one in found.windows[:TOLD] if one.share >= NAMED)}."


def _where(found: Failure) -> str:
    if not found.regions:
        return "The excess error is not concentrated anywhere: it is distributed like the force itself."
    first, chosen = found.regions[0], found.narrowed or found.regions[0]
    phase = f", {chosen.classed}" if found.narrowed else ""
    energy = f"which has {_percent(chosen.energy)} of the force's energy"
    return f"{_share(chosen.share)} of the excess error lies {place(first)}{phase}, {energy}."


def place(region: Region) -> str:
    """A region, as in `in cycles above 150 mm`."""
    if region.classed:
        return region.classed if region.name == "phase" else f"in the {region.name} of {region.classed}"
    above, below, unit = SIDES[region.name]
    return (above if region.is_above else below).format(_round(region.threshold * unit, 2))


def _corrections(found: Failure) -> Iterator[str]:
    yield (
        f"Another constant stiffness and damping would remove {_share(found.constant)} of the excess error; the best "
        f"function of displacement and velocity would remove {_share(found.over_motion)}."
    )
    helping = [(one, one.explained_share) for one in found.profiles if one.explained_share is not None]
    helping = [(one, away) for one, away in helping if away.low > found.constant.value + WORTH]
    helping.sort(key=lambda pair: -pair[1].value)
    if helping:
        shares = ", ".join(f"{_share(away)} with {_name(one)}" for one, away in helping[:TOLD])
        yield f"Stiffness and damping that vary would explain {shares}."


def _name(one: Profile) -> str:
    return "the phase of the loop" if one.name == "phase" else f"the {one.name}"


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
    return f"{_round(value * 1e-3, 3)} kN"


def _round(value: float, digits: int) -> str:
    return f"{float(f'{value:.{digits}g}'):,.10g}"
