"""Two effects at once, fitted together.

Effects that are added one after the other may both be stand-ins: dry friction alone resembles a damper in series with
its brace and a moat. Pairs are tested by scores beside each effect that came near alone, and those that promise most
are searched together.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from core.diagnosis.candidate_search import score_tests, search_in_parallel
from core.diagnosis.ranking import Ranking, ScoredCandidate, delta_bic
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, at_values, chi_square, fitted, inflation, reweighted_data
from core.fitting.search import Outcome
from core.model.isolator import Isolator, parameter

FIRSTS = 4
"""Effects beside which a second one is tested, those that explain most alone. A choice, for its time."""
SEARCHED = 5
"""Pairs at most that are searched. A choice, for its time."""
SHAKEN = 1.6
"""Ratio by which lengths are changed for another search. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A model with two more effects, beside the best model so far, on the same data."""

    effects: tuple[str, ...]
    fit: Fit
    so_far: Fit
    data: FitData
    delta_bic: float
    """BIC of the pair's model less that of the best so far."""


def best_pair(
    by_noise: FitData, first: Ranking, effects: Collection[str], so_far: Isolator, share: float
) -> Joint | None:
    """The pair of effects that explains most; None if none explains enough.

    Args:
        by_noise: the records, weighed by their noise.
        first: ranking of single effects beside the model as it came.
        effects: names of those that may be added.
        so_far: the best model by other ways.
        share: of the residual's power by that model, that a pair may leave at most.
    """
    places: dict[tuple[str, ...], list[Isolator]] = {}
    for names, model in _promising(first, effects):
        places.setdefault(names, []).append(model)
    if not places:
        return None
    keys = {"+".join(names): names for names in places}
    most = share * chi_square(first.data, so_far)
    fits = search_in_parallel(first.data, {key: places[names] for key, names in keys.items()}, below=most)
    found = {keys[key]: fit for key, fit in fits.items() if fit.chi_square < most}
    if not found:
        return None
    names = min(found, key=lambda one: found[one].chi_square)
    data = reweighted_data(by_noise, at_values(by_noise, found[names].model))
    (fit,) = search_in_parallel(data, {"pair": list(_shaken(found[names].model, names))}).values()
    before = fitted(data, so_far)
    if Outcome.DIVERGED in {fit.outcome, before.outcome}:
        return None
    return Joint(names, fit, before, data, delta_bic(data, before, fit, inflation(data, fit)))


def _shaken(model: Isolator, effects: Collection[str]) -> Iterator[Isolator]:
    """The model, and the same with each length of these effects shorter and longer: at a length where a law changes
    abruptly a search may end beside the minimum."""
    yield model
    for effect in effects:
        values = model.effects[effect]
        for name in (one.name for one in EFFECTS[effect].parameters if one.unit == "m"):
            low, high = parameter((effect, name)).bounds
            for factor in (1 / SHAKEN, SHAKEN):
                other = {**values, name: float(np.clip(values[name] * factor, low, high))}
                yield Isolator({**model.effects, effect: other})


def _promising(first: Ranking, effects: Collection[str]) -> Iterator[tuple[tuple[str, ...], Isolator]]:
    """Pairs by their names in order, and models with them to search from; the most promising first."""
    nearest = sorted(first.candidates, key=lambda one: one.fit.chi_square)[:FIRSTS]
    predicted = sorted(
        (
            (one.fit.chi_square - place.gain, tuple(sorted((one.effect, place.effect))), place.model)
            for one in nearest
            for places in score_tests(first.data, one.fit, _others(one, effects))
            for place in places
        ),
        key=lambda one: one[0],
    )
    best = list(dict.fromkeys(names for _, names, _ in predicted))[:SEARCHED]
    yield from ((names, model) for _, names, model in predicted if names in best)


def _others(one: ScoredCandidate, effects: Collection[str]) -> list[str]:
    return [name for name in effects if name not in one.fit.model.effects]
