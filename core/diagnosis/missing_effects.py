"""Physical effects that a model lacks, and whether adding them helps.

Effects are added one at a time, each time the best of those that are left, until the records support no more. Where
these leave something, pairs are then searched together, since several effects may have one stand-in. Where there are
three, each is compared with all others once again and more are added, as long as the force's error falls. Whatever no
effect explains is reported beside every name: if the library lacks the true effect, a wrong name is nearly always
significant.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol

import numpy as np

from core.diagnosis.held_lengths import with_best_lengths
from core.diagnosis.joint_effects import Joint, best_pair
from core.diagnosis.plausibility import ends, objection
from core.diagnosis.ranking import DECISIVE, Dropped, Ranking, ScoredCandidate, delta_bic, ranked
from core.diagnosis.unexplained import ABOVE_COLOURED, ABOVE_FLOOR, Unexplained, unexplained
from core.diagnosis.worth import Judge, NoiseRatios, Worth, excess, worth
from core.effect import RESULTS
from core.effects import EFFECTS
from core.errors import ModelError, RecordError
from core.fitting.data import FitData
from core.fitting.fit import Fit, check_motion, chi_square, error, fitted, reweighted_fit
from core.fitting.observation import Observation
from core.fitting.search import Outcome as SearchOutcome
from core.model.isolator import Isolator

PAIR = 2
"""Effects that are searched together."""
PAIRED = 0.02
"""Share of the excess error that the effects leave, from which on pairs are tested. A choice, for their time."""
MOST_EFFECTS = 3
"""Effects that one diagnosis adds at most. A choice."""
FEW_EFFECTS = 2
"""Largest number of effects that are named; if more seem missing, the true effect is rather not in the library. Chosen
on even seeds of benchmarks.diagnosis."""
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
"""Noise ratio from which on ANOTHER_OF_LITTLE and MOST_OF_IT apply. Chosen on even seeds of benchmarks.diagnosis."""
LOWERS = 0.98
"""Largest ratio of the force's error in N after and before an effect for which the effect is named. Chosen on even
seeds of benchmarks.diagnosis."""
MOST_UNEXPLAINED = 0.5
"""Share of the excess error that the library's effects leave, from which on the cause is unknown. Chosen on even seeds
of benchmarks.diagnosis."""
FEW_RATIOS = 3.0
"""Noise ratio from which on what an effect leaves shows another law than its own,"""
NEARLY = 0.9
"""and share of the excess error from which on that law is at least of the same kind. Where a law leaves something, all
that take this share may be meant. Both were chosen on 35 trials of benchmarks.diagnosis with seed 0."""
HOPEFUL = 0.5
"""Share of the excess error from which on the search for such an effect goes on to its end. A choice, for its time."""


class Rank(Protocol):
    """Ranks the effects that a model is without."""

    def __call__(self, now: Isolator, known: Isolator | None = None) -> Ranking:
        """Ranking for the model `now`, with one effect more at known values."""


class Outcome(Enum):
    """Outcome of a diagnosis."""

    NOTHING_MISSING = "nothing_missing"
    REFIT = "refit"
    EFFECT = "effect"
    ONE_OF_SET = "one_of_set"
    FAMILY = "family"
    UNKNOWN = "unknown"
    OUT_OF_RANGE = "out_of_range"
    """No effect is missing where the model was fitted; it fails on held-out earthquakes."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """Diagnosis by the records: effects to add, rankings, and the remaining structure."""

    outcome: Outcome
    given: Isolator
    """The model as it came."""
    refitted: Fit
    """The same effects, their values fitted."""
    steps: tuple[Step, ...]
    """Effects added, the one first that lowers the force's error most. If the outcome is unknown they have no name:
    what is missing resembles them."""
    idle: tuple[Step, ...]
    """Effects for which there is evidence, but which take too little of the excess error to be added."""
    after: Fit
    """The model with all of them."""
    before: Unexplained
    """Remaining structure of the refitted model."""
    unexplained: Unexplained
    """Remaining structure of the model with all effects."""
    first: Ranking
    """Ranking of the candidates for the refitted model."""
    last: Ranking
    """Ranking of the candidates for the model with all effects."""
    ratios_before: NoiseRatios
    """Of the refitted model."""
    ratios_after: NoiseRatios
    """Of the model with all effects."""

    @property
    def explained(self) -> Worth:
        """Shares of the excess error that all effects take together."""
        return worth(self.ratios_before, self.ratios_after)

    @property
    def named(self) -> tuple[Step, ...]:
        """Effects that are missing; none if the outcome is unknown."""
        return () if self.outcome is Outcome.UNKNOWN else self.steps

    @property
    def resembles(self) -> tuple[str, ...]:
        """Names of the effects that are nearest to something unknown; none for other outcomes."""
        if self.outcome is not Outcome.UNKNOWN:
            return ()
        return tuple(step.chosen.effect for step in (*self.steps, *self.idle))

    @property
    def dropped(self) -> tuple[Dropped, ...]:
        """Effects that could not be judged, in any of the rankings, by their names."""
        rankings = (self.first, *(step.ranking for step in self.steps), self.last)
        each = {one.effect: one for ranking in rankings for one in ranking.dropped}
        return tuple(each[name] for name in sorted(each))

    @property
    def is_unknown(self) -> bool:
        """True if a few of the library's effects do not explain the residual."""
        return self.unexplained.is_there or len(self.steps) > FEW_EFFECTS


def _unreported(step: str) -> None:
    """Progress that is not reported."""


def diagnosed(
    observations: Sequence[Observation],
    model: Isolator,
    effects: Collection[str] | None = None,
    report_step: Callable[[str], None] = _unreported,
    held_out: Sequence[Observation] = (),
) -> Diagnosis:
    """Diagnose a model by the records of several earthquakes.

    Args:
        observations: of the earthquakes.
        model: effects and values.
        effects: names of those that may be added; None for all there are.
        report_step: called after each ranking that leads to another one, with the effects so far, in words.
        held_out: of other earthquakes, which nothing is fitted to: an effect must explain them too.

    Raises:
        RecordError: no observation, or none with motion and force.
        ModelError: a model's force grew beyond all bounds.
    """
    if not observations:
        raise RecordError("no earthquake is left for the diagnosis; give one that was analysed in this direction")
    check_motion(observations)
    by_noise = FitData.by_noise(sorted(observations, key=lambda one: one.start))
    allowed_effects = sorted(EFFECTS if effects is None else effects)

    first = ranked(by_noise, model, _others(allowed_effects, model))

    def rank(now: Isolator, known: Isolator | None = None) -> Ranking:
        return ranked(by_noise, now, _others(allowed_effects, now), known, first.base.model)

    steps, last = _added([], first, rank, report_step)
    if _may_be_stand_ins(steps, first, last):
        report_step(f"{_named(steps)}; testing pairs of effects")
        pair = best_pair(by_noise, first, allowed_effects, last.base.model)
        steps, last = _added(*_by_pair(pair, steps, last, rank), rank, report_step)
    lowest = np.inf
    while len(steps) > PAIR and (now := error(last.data, last.base)) < LOWERS * lowest:
        lowest = now
        steps, last = _added(*_swapped(steps, last, rank, report_step, steps[:-1]), rank, report_step)
    judge = Judge.of(observations, held_out)
    steps, idle, last = _earning(by_noise, judge, steps, last, rank)
    best = _step(first)
    is_one_law = best is not None and _looked_like_two(best, steps, idle)
    if best is not None and is_one_law:
        others = [one for one in (*steps, *idle) if one.chosen.effect != best.chosen.effect]
        steps, more, last = _earning(by_noise, judge, [best], rank(best.chosen.fit.model), rank)
        idle = [*more, *others]
    allowed = ABOVE_FLOOR if steps else ABOVE_COLOURED
    before, left = (unexplained(one.data, one.base, one.noise_ratio(one.base), allowed) for one in (first, last))
    if len(steps) == 1 and (left.is_there or is_one_law):
        steps = [_with_near(steps[0])]
    steps = [_with_plausible(one, last.base, judge, rank) for one in steps]
    after = judge.noise_ratios(last.base.model)
    outcome = _outcome(steps, before, left, after.held_out or 0.0, is_supported=bool(first.supported))
    if outcome is Outcome.NOTHING_MISSING and _is_off(first, first.base, model):
        outcome = Outcome.REFIT
    by_noise.memory.clear()
    return Diagnosis(
        outcome=outcome,
        given=model,
        refitted=first.base,
        steps=tuple(steps),
        idle=tuple(idle),
        after=last.base,
        before=before,
        unexplained=left,
        first=first,
        last=last,
        ratios_before=judge.noise_ratios(first.base.model),
        ratios_after=after,
    )


def _others(effects: Sequence[str], model: Isolator) -> list[str]:
    return [name for name in effects if name not in model.effects]


def _may_be_stand_ins(steps: Sequence[Step], first: Ranking, last: Ranking) -> bool:
    """True if a pair of effects could explain more than the steps, or as much as three of them."""
    left, before = (excess(one.noise_ratio(one.base)) for one in (last, first))
    return bool(steps) and (len(steps) > PAIR or left > PAIRED * before)


def _added(
    steps: Sequence[Step], last: Ranking, rank: Rank, report_step: Callable[[str], None]
) -> tuple[list[Step], Ranking]:
    """The steps and further ones, until the records support no more; and the last ranking.

    Before another effect is added, the held lengths of those that are there are searched.
    """
    steps = list(steps)
    while (more := _more(steps, last)) is not None:
        steps.append(more)
        report_step(f"{_named(steps)}; searching for another effect")
        last = rank(more.chosen.fit.model)
        better = with_best_lengths(last, [one.chosen.effect for one in steps])
        if better is not None:
            steps[-1] = replace(more, chosen=_from(more.ranking, more.chosen, better))
            last = rank(better)
    return steps, last


def _more(steps: Sequence[Step], last: Ranking) -> Step | None:
    """One more effect; None if there is none to add."""
    step = _step(last) if len(steps) < MOST_EFFECTS else None
    return step if step is not None and (not steps or _is_another(step)) else None


def _step(ranking: Ranking) -> Step | None:
    """The best effect that the records support; one against which something speaks only where it does against all."""
    supported = [(one, objection(one.effect, one.fit, ranking.data.observations)) for one in ranking.supported]
    plausible = without_needless([one for one, against in supported if against is None])
    named = plausible or [one for one, against in supported if against is not None and not against.is_impossible]
    return Step(ranking, named[0], tuple(named)) if named else None


def without_needless(alike: Sequence[ScoredCandidate]) -> list[ScoredCandidate]:
    """Those that contain no simpler law, and those that do and are decisively better than all of them."""
    contain = {one.effect for one in alike if EFFECTS[one.effect].special}
    best = min((one.delta_bic for one in alike if one.effect not in contain), default=np.inf)
    return [one for one in alike if one.effect not in contain or one.delta_bic < best - DECISIVE]


def _is_another(step: Step) -> bool:
    """True if the chosen candidate is a separate effect beside those already added."""
    ranking, best = step.ranking, step.chosen.fit
    removed = 1 - best.chi_square / ranking.base.chi_square
    before, after = (ranking.noise_ratio(fit) for fit in (ranking.base, best))
    beyond = max(before**2 - 1, 0.0)
    is_most = before > ABOVE_NOISE and before**2 - after**2 > MOST_OF_IT * beyond
    return removed > ANOTHER or (removed > ANOTHER_OF_LITTLE and is_most)


def _swapped(
    steps: list[Step], last: Ranking, rank: Rank, report_step: Callable[[str], None], tested: Sequence[Step]
) -> tuple[list[Step], Ranking]:
    """Each effect that is to be tested, once more against all others, now that those after it are there.

    It is removed if the records support nothing in its place, and replaced if they support another effect, or the same
    effect at values that explain more: the values from before the later ones may lie in a local minimum of the misfit.
    """
    for step in tuple(tested):
        report_step(f"{_named(steps)}; testing again {step.chosen.effect}, beside the later ones")
        ranking = rank(_without(last.base.model, step.chosen.effect), last.base.model)
        again = _step(ranking)
        is_named = again is not None and step.chosen.effect in {one.effect for one in again.alike}
        if again is not None and is_named and not _is_off(ranking, again.chosen.fit, last.base.model):
            continue
        steps = [one for one in steps if one is not step] + ([] if again is None else [again])
        last = rank(ranking.base.model if again is None else again.chosen.fit.model)
    return steps, last


def _without(model: Isolator, effect: str) -> Isolator:
    return Isolator({name: values for name, values in model.effects.items() if name != effect})


def _by_pair(joint: Joint | None, steps: list[Step], last: Ranking, rank: Rank) -> tuple[list[Step], Ranking]:
    """The two effects of a pair instead of the steps, if they explain more, or as much as three; the last ranking."""
    if joint is None or not _is_better(joint, steps):
        return steps, last
    model, made = joint.fit.model, list[Step]()
    for effect in joint.effects:
        again = _step(rank(_without(model, effect), model))
        if again is None:
            return steps, last
        made.append(again)
        model = again.chosen.fit.model
    return made, rank(model)


def _is_better(joint: Joint, steps: Sequence[Step]) -> bool:
    """True if a pair explains more than the steps: much more than one step, as much as three."""
    before, after = (error(joint.data, fit) for fit in (joint.so_far, joint.fit))
    if len(steps) > PAIR:
        return joint.so_far.chi_square > (1 - ANOTHER_OF_LITTLE) * joint.fit.chi_square
    lowers = joint.delta_bic < -DECISIVE and after < LOWERS * before
    return lowers and (len(steps) > 1 or joint.fit.chi_square < (1 - ANOTHER) * joint.so_far.chi_square)


def _earning(
    by_noise: FitData, judge: Judge, steps: list[Step], last: Ranking, rank: Rank
) -> tuple[list[Step], list[Step], Ranking]:
    """The steps whose effects earn a name, those first that the force's error needs most; the others; and the last
    ranking.

    An effect that was added before another was exchanged may have lost its worth; and what is likely by the whitened
    error need not lower the error that an engineer sees, or the error of earthquakes that it was not fitted to.
    """
    idle: list[Step] = []
    while steps:
        now, after = last.base.model.effects, judge.noise_ratios(last.base.model)
        whole, _ = _refitted(by_noise, now)
        needed: dict[str, float] = {}
        for number, step in enumerate(steps):
            name = step.chosen.effect
            try:
                left, without = _refitted(by_noise, {n: v for n, v in now.items() if n != name})
            except ModelError:  # the others alone diverge at these values: those of the ranking without it do not
                left, without = np.inf, step.ranking.base.model
            needed[name] = left / whole
            steps[number] = replace(step, worth=worth(judge.noise_ratios(without), after))
        steps = sorted(steps, key=lambda step: -needed[step.chosen.effect])
        failing = [step for step in steps if not _earns(step, needed[step.chosen.effect])]
        if not failing:
            break
        steps, idle = [step for step in steps if step is not failing[-1]], [failing[-1], *idle]
        last = rank(Isolator({n: v for n, v in now.items() if n != failing[-1].chosen.effect}))
        if len(steps) > 1:
            steps, last = _swapped(steps, last, rank, _unreported, steps)
    return steps, idle, last


def _looked_like_two(best: Step, steps: Sequence[Step], idle: Sequence[Step]) -> bool:
    """True if one law of another form than the library's looked like two.

    Of two steps, one earned no name and the other is not the nearest law; or the nearest law takes nearly all by
    itself, and the others are forces of its family or take nearly all by themselves too.
    """
    if len(steps) == 1:
        return bool(idle) and best.chosen.effect != steps[0].chosen.effect
    ranking = best.ranking
    most = (1 - NEARLY) * _excess(ranking, ranking.base)
    near = {one.effect for one in (best.chosen, *ranking.candidates) if _excess(ranking, one.fit) < most}
    if len(steps) < 2 or best.chosen.effect not in near:
        return False
    return _are_of_one_kind(steps) or all(_is_force(step) and step.chosen.effect in near for step in steps)


def _are_of_one_kind(steps: Sequence[Step]) -> bool:
    """True if several steps are forces of one family, such as two viscous ones."""
    families = {EFFECTS[step.chosen.effect].family for step in steps}
    return len(steps) > 1 and len(families) == 1 and all(map(_is_force, steps))


def _is_force(step: Step) -> bool:
    """True if the effect is a force of its own, not a change of another effect's."""
    return EFFECTS[step.chosen.effect].acts_on == RESULTS[0]


def _excess(ranking: Ranking, fit: Fit) -> float:
    return excess(ranking.noise_ratio(fit))


def _earns(step: Step, needed: float) -> bool:
    """True if an effect lowers the force's error, and takes enough of the excess."""
    return needed > 1 / LOWERS and step.worth is not None and step.worth.earns_a_name


def _refitted(by_noise: FitData, effects: Mapping[str, Mapping[str, float]]) -> tuple[float, Isolator]:
    """N, error of the force of a model with these effects, fitted from these values; and the model."""
    whole = reweighted_fit(by_noise, Isolator(effects))
    return error(whole.data, whole.fit), whole.fit.model


def _named(steps: Sequence[Step]) -> str:
    return ", ".join(f"step {number}: {step.chosen.effect}" for number, step in enumerate(steps, 1))


def _is_off(ranking: Ranking, fit: Fit, given: Isolator) -> bool:
    """True if the fitted values lower the error of the given ones by an amount that matters."""
    left = chi_square(ranking.data, given)
    evident = (left - fit.chi_square) / ranking.inflation > DECISIVE + len(fit.free) * np.log(ranking.independent)
    return bool(evident and left > (1 + WORTH) ** 2 * fit.chi_square)


def _with_near(step: Step) -> Step:
    """The step with all effects that take nearly all of the excess error and are possible, since no law is quite right:
    at the end of its range a value then makes an effect no less likely.

    The search for an effect that was far behind the best had been stopped; here it goes on.
    """
    ranking = step.ranking
    most = (1 - NEARLY) * _excess(ranking, ranking.base)
    return _also(step, ranking, lambda one: _excess(ranking, one.fit) < most and not _is_impossible(one, ranking))


def _with_plausible(step: Step, final: Fit, judge: Judge, rank: Rank) -> Step:
    """The step, and if a value of its effect is at the end of its range, all effects against which nothing speaks and
    which would earn a name in its place: such a law may imitate another one, as a damper of a small power does sharp
    yield.

    Args:
        step: of the model's effects.
        final: of the model with all effects that were added.
        judge: of the names.
        rank: of the effects in the step's place.
    """
    if not any(ends(step.chosen.effect, final)):
        return step
    without, ranking = _without(final.model, step.chosen.effect), step.ranking
    if without.effects.keys() != ranking.base.model.effects.keys():
        ranking = rank(without, final.model)
    before, observations = judge.noise_ratios(ranking.base.model), ranking.data.observations

    def may_be_meant(one: ScoredCandidate) -> bool:
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
    better = _from(ranking, one, one.fit.model) if one.fit.outcome is SearchOutcome.STOPPED else one
    return better if better.fit.chi_square <= one.fit.chi_square else one


def _from(ranking: Ranking, one: ScoredCandidate, model: Isolator) -> ScoredCandidate:
    """The candidate searched from the values of a model."""
    fit = fitted(ranking.data, model)
    return replace(one, fit=fit, delta_bic=delta_bic(ranking.data, ranking.base, fit, ranking.inflation))


def _outcome(
    steps: Sequence[Step], before: Unexplained, left: Unexplained, left_held_out: float, *, is_supported: bool
) -> Outcome:
    """Outcome; an effect that the records support but that was not added leaves an unknown cause.

    Args:
        steps: effects that earned a name.
        before: structure without them.
        left: structure with them.
        left_held_out: noise ratio with them on held-out records; 0 without any.
        is_supported: whether the records supported any effect at first.
    """
    if not steps:
        return Outcome.UNKNOWN if before.is_there or is_supported else Outcome.NOTHING_MISSING
    if left.is_there and left.excess > MOST_UNEXPLAINED * before.excess:
        return Outcome.UNKNOWN
    sets = [{one.effect for one in step.alike} for step in steps]
    families = [{EFFECTS[name].family for name in one} for one in sets]
    every = set().union(*families)
    is_another_law = max(left.noise_ratio, left_held_out) > FEW_RATIOS
    if is_another_law and (left.excess > (1 - NEARLY) * before.excess or (len(steps) > 1 and len(every) > 1)):
        return Outcome.UNKNOWN
    if all(len(one) == 1 for one in sets):
        # one law of another form may look like two of its family
        is_one_law = _are_of_one_kind(steps) or (left.is_there and len(every) < len(steps))
        return Outcome.FAMILY if is_one_law or is_another_law else Outcome.EFFECT
    return Outcome.FAMILY if all(len(one) == 1 for one in families) else Outcome.ONE_OF_SET
