"""Search for the absent effects that would explain a model's residual.

Score tests over a grid of each effect's parameters choose the starting points. All effects are then searched at once,
step by step; a search ends early when it cannot come near the best one, since effects that are far behind do not matter
to a diagnosis. Only effects that came near are searched from another starting point too.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice, product
from types import MappingProxyType

import numpy as np
import scipy

from core.arrays import Mask, Matrix, Vector
from core.concurrency import at_once
from core.effect import LogNormal, Parameter
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, finish_search, signatures, tangents
from core.fitting.observation import Observation
from core.fitting.projection import model_of
from core.fitting.search import MOST_STEPS, Outcome, Search, leads_to, start_search, step_search
from core.model.isolator import Isolator, Key, parameter

GRID = (5, 3, 2)
"""Values of a candidate's parameter that are tried, if it has one, two or more that are not proportional. A choice."""
POLISHED = 2
"""Number of the best places from which a search starts, besides the best one at another length. A choice."""
PROMISING = 0.85
"""Share of the best place's gain from which on another place is worth a search. Chosen on even seeds of
benchmarks.diagnosis."""
OWN = 1e-4
"""Share of a signature that must be its own, else the model's parameters imitate it. A choice."""
FREQUENCIES = (0.3, 8.0, 9)
"""Hz, from and to, and how many: of what swings by itself, which may be of a narrow band. A choice."""
INSTANTS = (0.2, 0.4, 0.6, 0.8)
"""Shares of the layer's travel in an earthquake at which a property may have changed. A choice."""
OFTEN_LACKING: Mapping[str, float] = MappingProxyType(
    {"u_cross": 0.0, "v_cross": 0.0, "ground": 0.0, "axial_load": 1.0}
)
"""Inputs of laws that records often lack, with the value that they then have."""
YIELDING = ("yielding", "sliding")
"""Kinds of forces that yield after an elastic length."""
LONGEST_SLIP = 1.5e-3
"""m: up to this, an elastic length is rather that of a slider, and from then on that of a damper which yields. One law
describes both where they have corners and the speed does not matter. A choice."""
FASTEST_FADING = 0.14
"""m/s: up to this, a force of sliding may fade with the speed as it does when sliding begins (Armstrong-Hélouvry et al.
1994: from less than a millimetre to a decimetre per second; a fit may exceed this slightly). Above it the force hardly
fades, and is rather friction that does not. In benchmarks.diagnosis, break-away friction was fitted with up to
0.115 m/s, and such a force in the place of friction with 0.17 to 0.22 m/s."""
WIDE = 4.0
"""Ratio of the largest to the smallest usual length or speed of an effect within the layer's motion, below which REACH
applies. A choice."""
REACH = 50.0
"""Ratio of the largest to the smallest length or speed that is then tried. A choice."""

REACHED = (0.3, 0.45, 0.6, 0.75, 0.9)
"""Shares of the largest displacement that are tried besides for a length of a law without memory, such as a clearance:
the law may act in the largest motion alone, between two of the usual lengths, and a search that begins below what it
is stays there. A choice."""

ReportShare = Callable[[float], None]
"""Called with the share of some work that is done."""


def unheard(share: float) -> None:
    """A share that is not reported."""


@dataclass(frozen=True, slots=True, eq=False)
class ScoreTest:
    """Expected reduction of chi-square by an effect at one place of its parameters, before any fit."""

    effect: str
    model: Isolator
    """The model with it, where a search would begin."""
    gain: float
    """Reduction of chi-square, with small changes of the model's other parameters."""


def score_tests_of_forms(data: FitData, base: Fit, effect: str) -> tuple[ScoreTest, ...]:
    """Best place to begin a search for every other form of an effect's law, the most promising form first.

    Args:
        data: the records, weighed.
        base: the model without the effect, fitted to the records.
        effect: its name.
    """
    about = EFFECTS[effect]
    usual = {name: parameter((effect, name)).prior.median for name in about.forms}
    every = (dict(zip(usual, values, strict=True)) for values in product(*((usual[n], *about.forms[n]) for n in usual)))
    basis = np.linalg.qr(tangents(data, base).T).Q
    best = [_gains_by_place(data, base, basis, effect, form)[0] for form in islice(every, 1, None)]
    return tuple(sorted(best, key=lambda one: -one.gain))


def score_tests(
    data: FitData, base: Fit, effects: Collection[str], report: ReportShare = unheard
) -> tuple[tuple[ScoreTest, ...], ...]:
    """Best places to begin a search for every effect: Rao's (1948) score test over a grid of its shapes.

    The most promising effect first, and of each the best place.

    Args:
        data: the records, weighed.
        base: the model without them, fitted to the records.
        effects: their names.
        report: called with the share of the effects that are tested.
    """
    basis = np.linalg.qr(tangents(data, base).T).Q
    tests = []
    with closing(at_once(lambda effect: _by_place(data, base, basis, effect), effects)) as places:
        for number, best in enumerate(places, 1):
            tests.append(best)
            report(number / len(effects))
    return tuple(sorted(tests, key=lambda places: -places[0].gain))


def _by_place(data: FitData, base: Fit, basis: Matrix, effect: str) -> tuple[ScoreTest, ...]:
    if not is_excited(effect, data.observations):
        usual = {one.name: one.prior.median for one in EFFECTS[effect].parameters}
        return (ScoreTest(effect, Isolator({**base.model.effects, effect: usual}), 0.0),)
    best = _gains_by_place(data, base, basis, effect, {})
    if yields_beside(effect) and EFFECTS[effect].kind == "yielding":  # its sharpness depends on its length
        before = [[_lengths(other) for other in best[:number]] for number in range(len(best))]
        return tuple(one for one, others in zip(best, before, strict=True) if others.count(_lengths(one)) < POLISHED)
    best = [one for one in best if one.gain >= PROMISING * best[0].gain]
    other = [one for one in best[POLISHED:] if _lengths(one) != _lengths(best[0])]
    return (*best[:POLISHED], *other[:1])


def _gains_by_place(data: FitData, base: Fit, basis: Matrix, effect: str, form: Mapping[str, float]) -> list[ScoreTest]:
    """Score tests over an effect's grid, in a form of its law, the best place first; {} for the usual form."""
    values = ({**of, **form} for of in starts(effect, data.observations))
    models = [Isolator({**base.model.effects, effect: of}) for of in values]
    gains = _gains(base.residual, basis, signatures(data, base, models), _is_one_sided(effect))
    places = [ScoreTest(effect, model, gain) for model, gain in zip(models, gains, strict=True)]
    return sorted(places, key=lambda one: -one.gain)


def yields_beside(effect: str) -> bool:
    """True for a force that yields or slides beside the damper's: of the two lengths, either may be the shorter one.

    The misfit has a minimum on either side. A model that was fitted without the effect has drawn the damper to the
    effect's length, so that a search from there may end in the wrong one.
    """
    return EFFECTS[effect].kind in YIELDING and EFFECTS[effect].publishes is None


def unusual_length(effect: str, model: Isolator) -> Parameter | None:
    """Length of a slip that is rather a damper's, or of a damper that is rather a slip; None if it is usual.

    A law with more memory than its force, as of steel, is no slider whatever its length.
    """
    if len(EFFECTS[effect].states) > 1:
        return None
    lengths = [one for one in EFFECTS[effect].parameters if one.unit == "m"] if yields_beside(effect) else []
    slides, values = EFFECTS[effect].kind == "sliding", model.effects[effect]
    return next((one for one in lengths if (values[one.name] > LONGEST_SLIP) == slides), None)


def unusual_speed(effect: str, model: Isolator) -> Parameter | None:
    """Speed at which a force of sliding fades, if that is too high for friction as it begins; None if it is usual."""
    slides, values = EFFECTS[effect].kind == "sliding", model.effects[effect]
    speeds = [one for one in EFFECTS[effect].parameters if one.unit == "m/s"] if slides else []
    return next((one for one in speeds if values[one.name] > FASTEST_FADING), None)


def _lengths(one: ScoreTest) -> list[float]:
    """m, at which a law changes abruptly: a search rarely leaves a wrong one."""
    values = one.model.effects[one.effect]
    return [values[of.name] for of in EFFECTS[one.effect].parameters if of.unit == "m"]


def is_excited(effect: str, observations: Sequence[Observation]) -> bool:
    """False for an effect of motion that no record has: in the other direction, of the ground, or vertical."""
    needed = [name for name in OFTEN_LACKING if name in EFFECTS[effect].needs]
    each = ((getattr(one.conditions, name), OFTEN_LACKING[name]) for one in observations for name in needed)
    return not needed or any((series != lacking).any() for series, lacking in each)


def _is_one_sided(effect: str) -> tuple[bool, ...]:
    """True for each amplitude parameter of the effect that cannot be negative."""
    return tuple(parameter((effect, name)).bounds[0] >= 0 for name in EFFECTS[effect].linear) or (True,)


def _gains(residual: Vector, basis: Matrix, each: Sequence[Matrix], one_sided: Sequence[bool]) -> list[float]:
    """Reductions of the residual by least squares with each signature's own part, within the allowed signs."""
    gains = [-np.inf] * len(each)  # where it is not finite, the law is too fast for the records at these values
    finite = [n for n, signature in enumerate(each) if np.isfinite(signature).all()]
    if not finite:
        return gains
    rows = np.concatenate([each[n] for n in finite])
    own = rows - (rows @ basis) @ basis.T
    size, before = np.linalg.norm(own, axis=1), np.linalg.norm(rows, axis=1)
    for number, row in zip(finite, range(0, len(rows), len(one_sided)), strict=True):
        of = slice(row, row + len(one_sided))
        gains[number] = _gain(residual, own[of], size[of], size[of] > OWN * before[of], one_sided)
    return gains


def _gain(residual: Vector, own: Matrix, size: Vector, there: Mask, one_sided: Sequence[bool]) -> float:
    """Reduction by rows of these sizes, of which those that are not there do nothing."""
    if not there.any():
        return 0.0
    unit = own[there] / size[there, None]
    if len(unit) == 1:
        amplitude = float(unit[0] @ residual)
        return 0.0 if amplitude < 0 and one_sided[int(np.argmax(there))] else amplitude**2
    across = np.linalg.qr(unit.T)
    amplitudes = residual @ across.Q
    both = np.flatnonzero(~np.array(one_sided)[there])
    _, left = scipy.optimize.nnls(np.hstack([across.R, -across.R[:, both]]), amplitudes)
    return max(0.0, float(amplitudes @ amplitudes - left**2))


def starts(effect: str, observations: Sequence[Observation]) -> Iterator[Mapping[str, float]]:
    """Values of an effect's parameters to search from, within what the layer has seen."""
    about = EFFECTS[effect]
    usual = {one.name: one.prior.median for one in about.parameters}
    searched = [one for one in about.parameters if one.name not in (*about.linear, *about.held)]
    if not searched:
        yield usual
        return
    points = GRID[min(len(searched), len(GRID)) - 1]
    grids = [_grid(one, observations, points) for one in searched]
    if not about.states:
        grids = [_with_reached(one, grid, observations) for one, grid in zip(searched, grids, strict=True)]
    for values in product(*grids):
        yield {**usual, **{one.name: float(value) for one, value in zip(searched, values, strict=True)}}


def _with_reached(one: Parameter, grid: Vector, observations: Sequence[Observation]) -> Vector:
    """Values of a parameter to try; of a length, those within the largest motion too."""
    if one.unit != "m":
        return grid
    largest = max(float(np.abs(of.layer.displacement).max()) for of in observations)
    return np.unique([*grid, *np.clip(np.multiply(REACHED, largest), *one.bounds)])


def _grid(one: Parameter, observations: Sequence[Observation], points: int) -> Vector:
    low_end, high_end = one.bounds
    if one.is_instant:
        return _instants(observations)
    if one.unit == "Hz":
        return np.geomspace(*FREQUENCIES)
    seen = {
        "m": max(float(np.abs(o.layer.displacement).max()) for o in observations),
        "m/s": max(float(np.abs(o.layer.velocity).max()) for o in observations),
    }
    if one.unit in seen:
        high = min(0.9 * seen[one.unit], one.prior.median * np.exp(2 * one.prior.spread))
        low = one.prior.median * np.exp(-2 * one.prior.spread)
        return np.clip(np.geomspace(low if low < high / WIDE else high / REACH, high, points + 1), low_end, high_end)
    spans = np.linspace(-1.0, 1.0, points) * one.prior.spread
    if isinstance(one.prior, LogNormal):
        return np.clip(one.prior.median * np.exp(spans), low_end, high_end)
    return np.clip(one.prior.median + spans, low_end, high_end)


def _instants(observations: Sequence[Observation]) -> Vector:
    """s, between every two earthquakes, and in each by the way that the layer went."""
    instants: list[float] = []
    for number, one in enumerate(observations):
        time, travel = one.conditions.time, np.cumsum(np.abs(one.layer.velocity))
        if number:
            instants.append(0.5 * float(observations[number - 1].conditions.time[-1] + time[0]))
        instants += [float(time[np.searchsorted(travel, share * travel[-1])]) for share in INSTANTS]
    return np.unique(instants)


SLIPS = (0.8, 1.25)
"""Factors of a slip at which another minimum is searched for. A choice."""
SPARE = 4.0
"""Ratio of the largest gain that a search may still have to that which its slope and its last step predict. A
choice."""
NEAR = 1.08
"""Ratio to the lowest cost of all searches: a search that may reach it continues. A choice."""
FEWEST_STEPS = 2
"""Steps that every first search makes: the slope at its start may predict no gain."""


def search_in_parallel(
    data: FitData,
    places: Mapping[str, Sequence[Isolator]],
    thorough: Collection[str] = (),
    below: float = np.inf,
) -> Mapping[str, Fit]:
    """Best fit of every effect: STOPPED if others were much better, DIVERGED if no start converged.

    Args:
        data: the records, weighed.
        places: by effect, models with it at values from which to search, the most promising first.
        thorough: effects that are searched from every place, and with their length and the damper's exchanged.
        below: chi-square; where a search cannot come below it, it is stopped.
    """
    first = {effect: start_search(data, models[0]) for effect, models in places.items()}
    searches = _in_turn(data, first, 0.5 * below)
    diverged = [effect for effect, one in searches.items() if one.outcome is Outcome.DIVERGED]
    again = dict.fromkeys([*_near(searches), *diverged, *thorough])

    def best(effect: str) -> Search:
        ended = [searches[effect]]
        if effect in again:
            _add_searches(data, ended, places[effect][1:], below=0.5 * below)
        if effect in thorough:
            _add_elsewhere(data, ended, effect)
        return _best(ended)

    found = dict(zip(places, at_once(best, places), strict=True))
    return {effect: finish_search(data, one, one.outcome or Outcome.STOPPED) for effect, one in found.items()}


def lower_fit(
    data: FitData,
    fit: Fit,
    places: Iterable[Isolator],
    worth: float,
    *,
    elsewhere: str | None = None,
    also: Collection[Key] = (),
    whole: bool = False,
) -> Fit | None:
    """Best fit from several places; None if none is lower than a known one by enough.

    Args:
        data: the records, weighed.
        fit: the known fit.
        places: models with the same effects at values from which to search, the most promising first.
        worth: reduction of chi-square that is enough.
        elsewhere: effect that is searched for with other lengths too, where it is lower; None for none.
        also: parameters that are searched for besides those of a fit.
        whole: True to continue each search to its end, also where its gains promise too little: a valley may bend.
    """
    known = start_search(data, fit.model)
    ended = [replace(known, point=replace(known.point, cost=known.cost - 0.5 * worth))]
    _add_searches(data, ended, places, also, fewest=MOST_STEPS if whole else 0)
    if _best(ended) is ended[0]:
        return None
    if elsewhere is not None:
        _add_elsewhere(data, ended, elsewhere)
    best = _best(ended)
    return finish_search(data, best, best.outcome or Outcome.STOPPED)


def _add_searches(
    data: FitData,
    ended: list[Search],
    places: Iterable[Isolator],
    also: Collection[Key] = (),
    below: float = np.inf,
    fewest: int = 0,
) -> None:
    """Add the searches from places to those that have ended, each continued while it may become the lowest.

    Args:
        data: the records, weighed.
        ended: the searches that have ended.
        places: models at values from which to search.
        also: parameters that are searched for besides those of a fit.
        below: cost that a search must come below to be worth continuing.
        fewest: steps before that is judged.
    """
    for model in places:
        ended.append(_continued(data, start_search(data, model, also=also), ended, below, fewest))


def _add_elsewhere(data: FitData, ended: list[Search], effect: str) -> None:
    """Add the searches from an effect's other lengths, by the values of the lowest that has ended."""
    exchanged = _exchanged(_best(ended), effect)
    _add_searches(data, ended, [] if exchanged is None else [exchanged])
    _add_searches(data, ended, list(_at_other_slips(_best(ended), effect)))


def _exchanged(one: Search, effect: str) -> Isolator | None:
    """The model of a search with the length of an effect and the damper's exchanged; None if one has no such length."""
    values = dict(one.point.values)
    names = dict.fromkeys(name for name, _ in values)
    damper = next((name for name in names if EFFECTS[name].publishes), None)
    own, other = (
        next((key for key in values if key[0] == name and parameter(key).unit == "m"), None)
        for name in (effect, damper)
    )
    if own is None or other is None:
        return None
    for key, value in ((own, values[other]), (other, values[own])):
        values[key] = float(np.clip(value, *parameter(key).bounds))
    return model_of(values, tuple(names))


def _at_other_slips(one: Search, effect: str) -> Iterator[Isolator]:
    """The model of a search with the slip of an effect a little shorter or longer; none if the effect does not slide.

    A slip is over within a few samples, and the misfit has minima that lie as close to each other.
    """
    if EFFECTS[effect].kind != "sliding":
        return
    values = dict(one.point.values)
    names = tuple(dict.fromkeys(name for name, _ in values))
    for key in [key for key in values if key[0] == effect and parameter(key).unit == "m"]:
        for times in SLIPS:
            yield model_of({**values, key: float(np.clip(times * values[key], *parameter(key).bounds))}, names)


def _in_turn(data: FitData, running: dict[str, Search], below: float) -> dict[str, Search]:
    """The searches, each continued until it ends or cannot reach the best, or a cost."""
    while waiting := list(_hopeful(running, below)):
        after = at_once(lambda effect: step_search(data, running[effect]), waiting)
        running.update(zip(waiting, after, strict=True))
    return running


def _hopeful(running: Mapping[str, Search], below: float) -> Iterator[str]:
    near = min(NEAR * _least(running), below)
    for effect, one in running.items():
        if one.outcome is None and (one.steps < FEWEST_STEPS or _may_reach(one, near)):
            yield effect


def _near(searches: Mapping[str, Search]) -> Iterator[str]:
    near = NEAR * _least(searches)
    return (effect for effect, one in searches.items() if one.cost < near)


def _least(searches: Mapping[str, Search]) -> float:
    return min((one.cost for one in searches.values()), default=0.0)


def _best(ended: Sequence[Search]) -> Search:
    return min(ended, key=lambda one: one.cost)


def _continued(data: FitData, other: Search, ended: Sequence[Search], below: float, fewest: int) -> Search:
    """The other search, continued while it may become the lowest and come below a cost, and leads to no known
    minimum."""
    lowest = min(_best(ended).cost, below)
    while other.outcome is None and not any(leads_to(other, one) for one in ended):
        if other.steps >= fewest and not _may_reach(other, lowest):
            break
        other = step_search(data, other)
    return other


def _may_reach(one: Search, cost: float) -> bool:
    return one.cost - SPARE * one.predicted_gain < cost
