"""Search for the effects that a model lacks: one at a time, in pairs, and each once again beside the later ones."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from core.diagnosis.held_values import with_best_held
from core.diagnosis.joint_effects import Joint, best_pair
from core.diagnosis.plausibility import objection
from core.diagnosis.ranking import DECISIVE, Ranking, ScoredCandidate, are_peers, delta_bic
from core.diagnosis.worth import Worth, excess
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, chi_square, error, fitted
from core.model.isolator import Isolator

PAIR = 2
"""Effects that are searched together."""
PAIRED = 0.02
"""Share of the excess error that the effects leave, from which on pairs are tested. A choice, for their time."""
MOST_EFFECTS = 3
"""Effects that one diagnosis adds at most. A choice."""
WORTH = 0.05
"""Smallest share of the residual that other values of the same parameters must remove to be worth a fit. Chosen on even
seeds of benchmarks.diagnosis."""
ANOTHER = 0.3
"""Share of the residual's power: an effect beside another one must explain more, since a law that is not quite
the true one leaves an error that others reduce a little;"""
ANOTHER_OF_LITTLE, MOST_OF_IT = 0.1, 0.6
"""or, where the noise ratio is above ABOVE_NOISE, more than the first share of the power and the second share of the
power beyond the noise. This separates a weak second effect from the rest of a law that is not quite the true one.
Chosen on even seeds of benchmarks.diagnosis."""
ABOVE_NOISE = 1.1
"""Noise ratio from which on a residual holds more than noise: ANOTHER_OF_LITTLE and MOST_OF_IT apply. Chosen on even
seeds of benchmarks.diagnosis."""
CLEAR, CLEAR_SHARE = 100.0, 0.04
"""or, where the noise ratio is not above ABOVE_NOISE, support by more than the first (−ΔBIC) that takes more than the
second of the power. Noise alone gave up to 60 and 0.03 in 16 trials with one law (even seeds of
benchmarks.diagnosis)."""
FEW_RATIOS = 3.0
"""Noise ratio from which on what an effect leaves shows another law than its own. Chosen on 35 trials of
benchmarks.diagnosis with seed 0."""
LOWERS = 0.98
"""Largest ratio of the force's error in N after and before an effect for which the effect is named. Chosen on even
seeds of benchmarks.diagnosis."""


class Rank(Protocol):
    """Ranks the effects that a model is without."""

    def __call__(self, now: Isolator, known: Isolator | None = None) -> Ranking:
        """Ranking for the model `now`, with one effect more at known values."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One effect added."""

    ranking: Ranking
    """Ranking of the candidates for the model without this effect."""
    chosen: ScoredCandidate
    alike: tuple[ScoredCandidate, ...]
    """Candidates that the records cannot distinguish from the best and against which nothing speaks; the chosen one
    is first. Where something speaks against all of them, those that are doubtful only."""
    worth: Worth | None = None
    """Share of the excess error that the effect takes beside the others; None until all are known."""


def unreported(step: str, share: float = 0.0) -> None:
    """Progress that is not reported."""


def searched(
    by_noise: FitData, first: Ranking, allowed: Collection[str], rank: Rank, report_step: Callable[[str], None]
) -> tuple[list[Step], Ranking]:
    """Steps by which the effects are found that the records support.

    Args:
        by_noise: records, weighted by their noise.
        first: ranking of the effects for the model without any of them.
        allowed: names of the effects that may be added.
        rank: of the effects for another model.
        report_step: called after each ranking that leads to another one, with the effects so far, in words.

    Returns:
        The steps, and the ranking of the effects for the model with all of theirs.
    """
    steps, last = _added(by_noise, [], first, rank, report_step)
    if _may_be_stand_ins(steps, first, last):
        report_step(f"{_named(steps)}; testing pairs of effects")
        pair = best_pair(by_noise, first, allowed, last.base.model, _pair_leaves(len(steps)))
        steps, last = _added(by_noise, *_by_pair(pair, steps, last, rank), rank, report_step)
    lowest = np.inf
    while _may_be_exchanged(steps, last) and (now := error(last.data, last.base)) < LOWERS * lowest:
        lowest = now
        steps, last = _added(by_noise, *swapped(steps, last, rank, report_step, steps[:-1]), rank, report_step)
    if len(steps) > 1:  # beside the others, a simpler law may do
        containing = [step for step in steps if EFFECTS[step.chosen.effect].special]
        steps, last = swapped(steps, last, rank, report_step, containing)
    return steps, last


def _added(
    by_noise: FitData, steps: Sequence[Step], last: Ranking, rank: Rank, report_step: Callable[[str], None]
) -> tuple[list[Step], Ranking]:
    """The steps and further ones, until the records support no more; and the last ranking.

    Before another effect is added, the held parameters of those that are there are searched.
    """
    steps = list(steps)
    while (more := _more(steps, last)) is not None:
        steps.append(more)
        report_step(f"{_named(steps)}; searching for another effect")
        better = with_best_held(by_noise, more.chosen.fit.model, [one.chosen.effect for one in steps])
        if better is not None:
            steps[-1] = replace(more, chosen=searched_from(more.ranking, more.chosen, better))
        last = rank(steps[-1].chosen.fit.model)
    return steps, last


def _more(steps: Sequence[Step], last: Ranking) -> Step | None:
    """One more effect; None if there is none to add."""
    step = best_step(last) if len(steps) < MOST_EFFECTS else None
    return step if step is not None and (not steps or _is_another(step)) else None


def best_step(ranking: Ranking) -> Step | None:
    """The best effect that the records support; one against which something speaks only where it does against all."""
    supported = [(one, objection(one.effect, one.fit, ranking.data.observations)) for one in ranking.supported]
    plausible = without_needless([one for one, against in supported if against is None])
    named = plausible or [one for one, against in supported if against is not None and not against.is_impossible]
    return Step(ranking, named[0], tuple(named)) if named else None


def without_needless(alike: Sequence[ScoredCandidate]) -> list[ScoredCandidate]:
    """Candidates that contain no simpler law, and those that do and are decisively better than all of them but their
    peers."""
    contain = {one.effect for one in alike if EFFECTS[one.effect].special}

    def best_beside(effect: str) -> float:
        simple = (one for one in alike if one.effect not in contain and not are_peers(effect, one.effect))
        return min((one.delta_bic for one in simple), default=np.inf)

    return [one for one in alike if one.effect not in contain or one.delta_bic < best_beside(one.effect) - DECISIVE]


def _is_another(step: Step) -> bool:
    """True if the chosen candidate is a separate effect beside those already added."""
    ranking, best = step.ranking, step.chosen.fit
    removed = 1 - best.chi_square / ranking.base.chi_square
    before, after = (ranking.noise_ratio(fit) for fit in (ranking.base, best))
    beyond = max(before**2 - 1, 0.0)
    is_most = before > ABOVE_NOISE and before**2 - after**2 > MOST_OF_IT * beyond
    is_clear = before <= ABOVE_NOISE and removed > CLEAR_SHARE and step.chosen.delta_bic < -CLEAR
    return removed > ANOTHER or (removed > ANOTHER_OF_LITTLE and is_most) or is_clear


def swapped(
    steps: list[Step], last: Ranking, rank: Rank, report_step: Callable[[str], None], tested: Sequence[Step]
) -> tuple[list[Step], Ranking]:
    """Each effect that is to be tested, once more against all others, now that those after it are there.

    It is removed if the records support nothing in its place, and replaced if they support another effect, or the same
    effect at values that explain more: the values from before the later ones may lie in a local minimum of the misfit.
    """
    for step in tuple(tested):
        report_step(f"{_named(steps)}; testing again {step.chosen.effect}, beside the later ones")
        ranking = rank(without(last.base.model, step.chosen.effect), last.base.model)
        again = best_step(ranking)
        is_named = again is not None and step.chosen.effect in {one.effect for one in again.alike}
        if again is not None and is_named and not is_off(ranking, again.chosen.fit, last.base.model):
            continue
        steps = [one for one in steps if one is not step] + ([] if again is None else [again])
        last = rank(ranking.base.model if again is None else again.chosen.fit.model)
    return steps, last


def _may_be_exchanged(steps: Sequence[Step], last: Ranking) -> bool:
    """True if one of three effects may stand in for another law of the library: where three leave much more than noise,
    their cause is none of them."""
    return len(steps) > PAIR and last.noise_ratio(last.base) <= FEW_RATIOS


def without(model: Isolator, effect: str) -> Isolator:
    """The model without one of its effects."""
    return Isolator({name: values for name, values in model.effects.items() if name != effect})


def _may_be_stand_ins(steps: Sequence[Step], first: Ranking, last: Ranking) -> bool:
    """True if a pair of effects could explain more than the steps, or as much as three of them."""
    left, before = (excess(one.noise_ratio(one.base)) for one in (last, first))
    return bool(steps) and (len(steps) > PAIR or left > PAIRED * before)


def _by_pair(joint: Joint | None, steps: list[Step], last: Ranking, rank: Rank) -> tuple[list[Step], Ranking]:
    """The two effects of a pair instead of the steps, if they explain more, or as much as three; the last ranking."""
    if joint is None or not _is_better(joint, steps):
        return steps, last
    model, made = joint.fit.model, list[Step]()
    for effect in joint.effects:
        again = best_step(rank(without(model, effect), model))
        if again is None:
            return steps, last
        made.append(again)
        model = again.chosen.fit.model
    return made, rank(model)


def _pair_leaves(steps: int) -> float:
    """Share of the residual's power by so many steps that a pair may leave at most to be searched on.

    Wider than `_is_better`, which judges it on data that are weighed anew.
    """
    if steps > PAIR:
        return 1 + ANOTHER
    return 1.0 if steps == PAIR else 1 - 0.5 * ANOTHER


def _is_better(joint: Joint, steps: Sequence[Step]) -> bool:
    """True if a pair explains more than the steps: much more than one step, as much as three."""
    before, after = (error(joint.data, fit) for fit in (joint.so_far, joint.fit))
    if len(steps) > PAIR:
        return joint.so_far.chi_square > (1 - ANOTHER_OF_LITTLE) * joint.fit.chi_square
    lowers = joint.delta_bic < -DECISIVE and after < LOWERS * before
    return lowers and (len(steps) > 1 or joint.fit.chi_square < (1 - ANOTHER) * joint.so_far.chi_square)


def is_off(ranking: Ranking, fit: Fit, given: Isolator) -> bool:
    """True if the fitted values lower the error of the given ones by an amount that matters."""
    left = chi_square(ranking.data, given)
    evident = (left - fit.chi_square) / ranking.inflation > DECISIVE + len(fit.free) * np.log(ranking.independent)
    return bool(evident and left > (1 + WORTH) ** 2 * fit.chi_square)


def searched_from(ranking: Ranking, one: ScoredCandidate, model: Isolator) -> ScoredCandidate:
    """The candidate searched from the values of a model."""
    fit = fitted(ranking.data, model)
    return replace(one, fit=fit, delta_bic=delta_bic(ranking.data, ranking.base, fit, ranking.inflation))


def _named(steps: Sequence[Step]) -> str:
    return ", ".join(f"step {number}: {step.chosen.effect}" for number, step in enumerate(steps, 1))
