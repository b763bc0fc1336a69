"""Names for the effects that a search added: which of them earn one, and which other effects may be meant."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from core.diagnosis.effect_search import (
    FEW_RATIOS,
    LOWERS,
    Rank,
    Step,
    searched_from,
    swapped,
    unreported,
    without,
    without_needless,
)
from core.diagnosis.plausibility import ends, objection
from core.diagnosis.ranking import DECISIVE, Ranking, ScoredCandidate
from core.diagnosis.unexplained import ABOVE_FLOOR
from core.diagnosis.worth import Judge, excess, worth
from core.effect import RESULTS
from core.effects import EFFECTS
from core.errors import ModelError
from core.fitting.data import FitData
from core.fitting.fit import Fit, error, reweighted_fit
from core.fitting.search import Outcome as SearchOutcome
from core.model.isolator import Isolator

NEARLY = 0.9
"""Share of the excess error from which on a law is at least of the same kind as the true one. Where a law leaves
something, all that take this share may be meant. Chosen on 35 trials of benchmarks.diagnosis with seed 0."""
CLOSE = 2.0
"""Largest ratio of the noise ratio that another law leaves to that of the best, or to 1 where this is more, with which
it may be meant: many laws take nine tenths of a huge error. A choice: of friction that grows smoothly with the speed,
friction leaves 1.06 times what a damper with relief does, and either may be meant; of hardening, a moat leaves 4.2
times what hardening does, and of friction, break-away friction 9.5 times what friction does."""
HOPEFUL = 0.5
"""Share of the excess error from which on the search for such an effect goes on to its end. A choice, for its time."""


def earning(
    by_noise: FitData, judge: Judge, steps: list[Step], last: Ranking, rank: Rank
) -> tuple[list[Step], list[Step], Ranking]:
    """The steps whose effects earn a name, those first that the force's error needs most; the others; and the last
    ranking.

    An effect that was added before another was exchanged may have lost its worth; and what is likely by the whitened
    error need not lower the error that an engineer sees, or the error of earthquakes that it was not fitted to.
    """
    idle: list[Step] = []
    model = last.base.model
    while steps:
        now, after = model.effects, judge.noise_ratios(model)
        whole, _ = _refitted(by_noise, now)
        needed: dict[str, float] = {}
        others: dict[str, Isolator] = {}
        for number, step in enumerate(steps):
            name = step.chosen.effect
            try:
                left, rest = _refitted(by_noise, without(model, name).effects)
                others[name] = rest
            except ModelError:  # the others alone diverge at these values: those of the ranking without it do not
                left, rest = np.inf, step.ranking.base.model
            needed[name] = left / whole
            steps[number] = replace(step, worth=worth(judge.noise_ratios(rest), after))
        steps = sorted(steps, key=lambda step: -needed[step.chosen.effect])
        failing = [step for step in steps if not _earns(step, needed[step.chosen.effect])]
        if not failing:
            break
        steps, idle = [step for step in steps if step is not failing[-1]], [failing[-1], *idle]
        name = failing[-1].chosen.effect
        if after.fitted > FEW_RATIOS and name in others:  # another law: an exchange makes no name
            model = others[name]
            continue
        last = rank(without(model, name))
        if len(steps) > 1:
            steps, last = swapped(steps, last, rank, unreported, steps)
        model = last.base.model
    return steps, idle, last if model is last.base.model else rank(model)


def certain(
    by_noise: FitData, judge: Judge, steps: list[Step], first: Ranking, last: Ranking, rank: Rank
) -> tuple[list[Step], list[Step], Ranking]:
    """Effects of several families, where the true law is another than theirs: those that take nearly all of the excess
    error beside the others; the rest, which may only stand in for what this law does besides; and the last ranking.

    All of them where the others alone would not take nearly all.

    Args:
        by_noise: records, weighted by their noise.
        judge: of the names.
        steps: those that earned a name.
        first: ranking for the model without any of them.
        last: ranking for the model with all of them.
        rank: of the effects for another model.
    """
    kept = [step for step in steps if takes_nearly_all(step)]
    rest = [step for step in steps if step not in kept]
    left = judge.noise_ratios(last.base.model)
    is_another_law = max(left.fitted, left.held_out or 0.0) > FEW_RATIOS
    if not kept or not rest or not is_another_law or not are_of_several_families(steps):
        return steps, [], last
    model = last.base.model
    for step in rest:
        model = without(model, step.chosen.effect)
    kept, idle, again = earning(by_noise, judge, kept, rank(model), rank)
    if _excess(again, again.base) > (1 - NEARLY) * _excess(first, first.base):
        return steps, [], last
    return kept, [*rest, *idle], again


def takes_nearly_all(step: Step) -> bool:
    """True if an effect takes nearly all of the excess error beside the others, wherever its share is known."""
    shares = () if step.worth is None else (step.worth.fitted, step.worth.held_out)
    return bool(shares) and all(one is None or one >= NEARLY for one in shares)


def are_of_several_families(steps: Sequence[Step]) -> bool:
    """True if the effects of several steps belong to more than one family."""
    return len({EFFECTS[step.chosen.effect].family for step in steps}) > 1


def _earns(step: Step, needed: float) -> bool:
    """True if an effect lowers the force's error, and takes enough of the excess."""
    return needed > 1 / LOWERS and step.worth is not None and step.worth.earns_a_name


def _refitted(by_noise: FitData, effects: Mapping[str, Mapping[str, float]]) -> tuple[float, Isolator]:
    """N, error of the force of a model with these effects, fitted from these values; and the model."""
    whole = reweighted_fit(by_noise, Isolator(effects))
    return error(whole.data, whole.fit), whole.fit.model


def left_out(idle: Sequence[Step], steps: Sequence[Step]) -> tuple[Step, ...]:
    """Steps that earned no name, the first one of each effect, without those whose effect earned one in another step.

    Args:
        idle: all that earned no name.
        steps: those that did.
    """
    seen = {step.chosen.effect for step in steps}
    kept = []
    for step in idle:
        if step.chosen.effect not in seen:
            kept.append(step)
            seen.add(step.chosen.effect)
    return tuple(kept)


def looked_like_two(best: Step, steps: Sequence[Step], idle: Sequence[Step], last: Ranking) -> bool:
    """True if one law of another form than the library's looked like two.

    Of two steps, one earned no name, and the other is not the nearest law and leaves as much; or the nearest law takes
    nearly all by itself, and the others are forces of its family or take nearly all by themselves too.

    Args:
        best: with the nearest law.
        steps: those that earned a name.
        idle: the others.
        last: of the model with all that earned a name.
    """
    if len(steps) == 1:
        left, nearest = last.noise_ratio(last.base), best.ranking.noise_ratio(best.chosen.fit)
        return bool(idle) and best.chosen.effect != steps[0].chosen.effect and nearest <= max(left, ABOVE_FLOOR)
    ranking = best.ranking
    most = (1 - NEARLY) * _excess(ranking, ranking.base)
    near = {one.effect for one in (best.chosen, *ranking.candidates) if _excess(ranking, one.fit) < most}
    if len(steps) < 2 or best.chosen.effect not in near:
        return False
    return are_of_one_kind(steps) or all(_is_force(step) and step.chosen.effect in near for step in steps)


def are_of_one_kind(steps: Sequence[Step]) -> bool:
    """True if several steps are forces of one family, such as two viscous ones."""
    families = {EFFECTS[step.chosen.effect].family for step in steps}
    return len(steps) > 1 and len(families) == 1 and all(map(_is_force, steps))


def _is_force(step: Step) -> bool:
    """True if the effect is a force of its own, not a change of another effect's."""
    return EFFECTS[step.chosen.effect].acts_on == RESULTS[0]


def with_near(step: Step) -> Step:
    """The step with all effects that take nearly all of the excess error, leave little more than the best and are
    possible, since no law is quite right: at the end of its range a value then makes an effect no less likely.

    The search for an effect that was far behind the best had been stopped; here it goes on.
    """
    ranking = step.ranking
    nearly = (1 - NEARLY) * _excess(ranking, ranking.base)
    most = min(nearly, excess(CLOSE * max(ranking.noise_ratio(step.chosen.fit), 1.0)))
    return _also(step, ranking, lambda one: _excess(ranking, one.fit) < most and not _is_impossible(one, ranking))


def with_plausible(step: Step, final: Fit, judge: Judge, rank: Rank, *, is_all: bool) -> Step:
    """The step, and if a value of its effect is at the end of its range, all effects against which nothing speaks and
    which would earn a name in its place: such a law may imitate another one, as a damper of a small power does sharp
    yield. Where the step leaves noise alone, an effect that leaves more than FEW_RATIOS cannot be meant.

    Args:
        step: of the model's effects.
        final: of the model with all effects that were added.
        judge: of the names.
        rank: of the effects in the step's place.
        is_all: True if nothing but noise is left with all effects that were added.
    """
    if not any(ends(step.chosen.effect, final)):
        return step
    base, ranking = without(final.model, step.chosen.effect), step.ranking
    if base.effects.keys() != ranking.base.model.effects.keys():
        ranking = rank(base, final.model)
    before, observations = judge.noise_ratios(ranking.base.model), ranking.data.observations

    def may_be_meant(one: ScoredCandidate) -> bool:
        if is_all and ranking.noise_ratio(one.fit) > FEW_RATIOS:
            return False
        is_plausible = objection(one.effect, one.fit, observations) is None
        return is_plausible and worth(before, judge.noise_ratios(one.fit.model)).earns_a_name

    return _also(step, ranking, may_be_meant)


def _also(step: Step, ranking: Ranking, may_be_meant: Callable[[ScoredCandidate], bool]) -> Step:
    """The step with further effects of a ranking, each where its search ends, that may be meant."""
    known, before = {one.effect for one in step.alike}, _excess(ranking, ranking.base)
    near = [
        found
        for one in ranking.candidates
        if one.effect not in known
        and one.delta_bic < -DECISIVE
        and _excess(ranking, one.fit) < (1 - HOPEFUL) * before
        and may_be_meant(found := _searched(ranking, one))
    ]
    needed = without_needless((*step.alike, *near))
    return replace(step, alike=(*step.alike, *(one for one in near if one in needed)))


def _is_impossible(one: ScoredCandidate, ranking: Ranking) -> bool:
    against = objection(one.effect, one.fit, ranking.data.observations)
    return against is not None and against.is_impossible


def _searched(ranking: Ranking, one: ScoredCandidate) -> ScoredCandidate:
    """The candidate where its search ends."""
    better = searched_from(ranking, one, one.fit.model) if one.fit.outcome is SearchOutcome.STOPPED else one
    return better if better.fit.chi_square <= one.fit.chi_square else one


def _excess(ranking: Ranking, fit: Fit) -> float:
    return excess(ranking.noise_ratio(fit))
