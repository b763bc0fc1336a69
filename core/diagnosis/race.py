"""Which of several effects, added to a model, come near to the one that explains most?

All are searched for at once, a step each in turn, and a search is left off when it has no hope of coming near: what
becomes of those that are far behind is of no matter to a diagnosis. Only those that came near are searched for from
another place too.
"""

from collections.abc import Iterator, Mapping, Sequence

from core.fitting.data import FitData
from core.fitting.fit import Fit, finish_search
from core.fitting.search import Outcome, Search, start_search, step_search
from core.model.isolator import Isolator

SPARE = 4.0
"""Times what its slope and its last step promise: so much a search may still gain."""
NEAR = 1.08
"""Times what the best one leaves over: a search that may come as near goes on."""
FEWEST_STEPS = 2
"""Of every effect's first search: a slope where a search begins may promise nothing."""


def search_in_parallel(data: FitData, places: Mapping[str, Sequence[Isolator]]) -> Mapping[str, Fit]:
    """Of every effect the best fit that was found; STOPPED where it was left behind, DIVERGED where no place led
    anywhere.

    Args:
        data: the records, weighed.
        places: by effect, models with it at values from which to search, the most promising first.
    """
    found = _in_turn(data, {effect: start_search(data, models[0]) for effect, models in places.items()})
    diverged = [effect for effect, one in found.items() if one.outcome is Outcome.DIVERGED]
    for effect in [*_near(found), *diverged]:
        for model in places[effect][1:]:
            found[effect] = _better(data, found[effect], start_search(data, model))
    return {effect: finish_search(data, one, one.outcome or Outcome.STOPPED) for effect, one in found.items()}


def _in_turn(data: FitData, running: dict[str, Search]) -> dict[str, Search]:
    """Until each has ended, or has no hope."""
    while waiting := list(_hopeful(running)):
        for effect in waiting:
            running[effect] = step_search(data, running[effect])
    return running


def _hopeful(running: Mapping[str, Search]) -> Iterator[str]:
    near = NEAR * _least(running)
    for effect, one in running.items():
        if one.outcome is None and (one.steps < FEWEST_STEPS or _may_reach(one, near)):
            yield effect


def _near(found: Mapping[str, Search]) -> Iterator[str]:
    near = NEAR * _least(found)
    return (effect for effect, one in found.items() if one.cost < near)


def _least(searches: Mapping[str, Search]) -> float:
    return min((one.cost for one in searches.values()), default=0.0)


def _better(data: FitData, known: Search, other: Search) -> Search:
    """The other search if it comes to a lower minimum than the known one."""
    while other.outcome is None and _may_reach(other, known.cost):
        other = step_search(data, other)
    return min(known, other, key=lambda one: one.cost)


def _may_reach(one: Search, cost: float) -> bool:
    return one.cost - SPARE * one.predicted_gain < cost
