"""Physical effects that a model lacks, and whether adding them helps.

Effects are added one at a time, each time the best of those that are left, until the records support no more. Where
there are several, each is then compared with all others once again and more are added, as long as the force's error
falls. Whatever no effect explains is reported beside every name: if the library lacks the true effect, a wrong name is
nearly always significant.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import numpy as np

from core.diagnosis.plausibility import objection
from core.diagnosis.ranking import DECISIVE, Dropped, Ranking, ScoredCandidate, ranked
from core.diagnosis.unexplained import ABOVE_COLOURED, ABOVE_FLOOR, Unexplained, unexplained
from core.effects import EFFECTS
from core.errors import RecordError
from core.fitting.data import FitData
from core.fitting.fit import Fit, chi_square, error, weighted_fit
from core.fitting.observation import Observation
from core.model.isolator import Isolator

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
"""Share of the error beyond the noise that the library's effects leave, from which on the cause is unknown. Chosen on
even seeds of benchmarks.diagnosis."""


Rank: TypeAlias = Callable[[Isolator], Ranking]
"""Ranks the effects that a model is without."""


class Outcome(Enum):
    """Outcome of a diagnosis."""

    NOTHING_MISSING = "nothing_missing"
    REFIT = "refit"
    EFFECT = "effect"
    ONE_OF_SET = "one_of_set"
    FAMILY = "family"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One effect added."""

    ranking: Ranking
    """Ranking of the candidates for the model without this effect."""
    chosen: ScoredCandidate
    alike: tuple[ScoredCandidate, ...]
    """Candidates that the records cannot distinguish from the best and against which nothing speaks; the chosen one
    is first. Where something speaks against all of them, those that are doubtful only."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """Diagnosis by the records: effects to add, rankings, and the remaining structure."""

    outcome: Outcome
    given: Isolator
    """The model as it came."""
    refitted: Fit
    """The same effects, their values fitted."""
    steps: tuple[Step, ...]
    """Effects added, the one first that lowers the force's error most."""
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
) -> Diagnosis:
    """Diagnose a model by the records of several earthquakes.

    Args:
        observations: of the earthquakes.
        model: effects and values.
        effects: names of those that may be added; None for all there are.
        report_step: called after each ranking that leads to another one, with the effects so far, in words.

    Raises:
        RecordError: no observation.
        ModelError: a model's force grew beyond all bounds.
    """
    if not observations:
        raise RecordError("no earthquake is left for the diagnosis; give one that was analysed in this direction")
    by_noise = FitData.by_noise(sorted(observations, key=lambda one: one.start))
    allowed_effects = sorted(EFFECTS if effects is None else effects)

    def rank(now: Isolator) -> Ranking:
        return ranked(by_noise, now, [name for name in allowed_effects if name not in now.effects])

    first = rank(model)
    steps, last = _added([], first, rank, report_step)
    lowest = np.inf
    while len(steps) > 1 and (now := error(last.data, last.base)) < LOWERS * lowest:
        lowest = now
        steps, last = _added(*_swapped(steps, last, rank, report_step), rank, report_step)
    steps, last = _without_idle(by_noise, steps, last, rank)
    allowed = ABOVE_FLOOR if steps else ABOVE_COLOURED
    before, left = (unexplained(one.data, one.base, one.noise_ratio(one.base), allowed) for one in (first, last))
    outcome = _outcome(steps, before, left, is_supported=bool(first.supported))
    if outcome is Outcome.NOTHING_MISSING and _is_off(first, first.base, model):
        outcome = Outcome.REFIT
    by_noise.memory.clear()
    return Diagnosis(
        outcome=outcome,
        given=model,
        refitted=first.base,
        steps=tuple(steps),
        after=last.base,
        before=before,
        unexplained=left,
        first=first,
        last=last,
    )


def _added(
    steps: Sequence[Step], last: Ranking, rank: Rank, report_step: Callable[[str], None]
) -> tuple[list[Step], Ranking]:
    """The steps and further ones, until the records support no more; and the last ranking."""
    steps = list(steps)
    while (more := _more(steps, last)) is not None:
        steps.append(more)
        report_step(f"{_named(steps)}; searching for another effect")
        last = rank(more.chosen.fit.model)
    return steps, last


def _more(steps: Sequence[Step], last: Ranking) -> Step | None:
    """One more effect; None if there is none to add."""
    step = _step(last) if len(steps) < MOST_EFFECTS else None
    return step if step is not None and (not steps or _is_another(step)) else None


def _step(ranking: Ranking) -> Step | None:
    """The best effect that the records support; one against which something speaks only where it does against all."""
    supported = [(one, objection(one.effect, one.fit, ranking.data.observations)) for one in ranking.supported]
    plausible = [one for one, against in supported if against is None]
    named = plausible or [one for one, against in supported if against is not None and not against.is_impossible]
    return Step(ranking, named[0], tuple(named)) if named else None


def _is_another(step: Step) -> bool:
    """True if the chosen candidate is a separate effect beside those already added."""
    ranking, best = step.ranking, step.chosen.fit
    removed = 1 - best.chi_square / ranking.base.chi_square
    before, after = (ranking.noise_ratio(fit) for fit in (ranking.base, best))
    beyond = max(before**2 - 1, 0.0)
    is_most = before > ABOVE_NOISE and before**2 - after**2 > MOST_OF_IT * beyond
    return removed > ANOTHER or (removed > ANOTHER_OF_LITTLE and is_most)


def _swapped(
    steps: list[Step], last: Ranking, rank: Rank, report_step: Callable[[str], None]
) -> tuple[list[Step], Ranking]:
    """Each effect but the last one added, once more against all others, now that those after it are there.

    It is removed if the records support nothing in its place, and replaced if they support another effect, or the same
    effect at values that explain more: the values from before the later ones may lie in a local minimum of the misfit.
    """
    for step in tuple(steps[:-1]):
        report_step(f"{_named(steps)}; testing again {step.chosen.effect}, beside the later ones")
        without = Isolator({n: v for n, v in last.base.model.effects.items() if n != step.chosen.effect})
        ranking = rank(without)
        again = _step(ranking)
        is_named = again is not None and step.chosen.effect in {one.effect for one in again.alike}
        if again is not None and is_named and not _is_off(ranking, again.chosen.fit, last.base.model):
            continue
        steps = [one for one in steps if one is not step] + ([] if again is None else [again])
        last = rank(ranking.base.model if again is None else again.chosen.fit.model)
    return steps, last


def _without_idle(by_noise: FitData, steps: list[Step], last: Ranking, rank: Rank) -> tuple[list[Step], Ranking]:
    """The steps whose effects the force's error needs, those first that it needs most; and the last ranking.

    An effect that was added before another was exchanged may have lost its worth; and what is likely by the whitened
    error need not lower the error that an engineer sees.
    """
    while steps:
        now = last.base.model.effects
        whole = _error(by_noise, now)
        worth = {
            step.chosen.effect: _error(by_noise, {n: v for n, v in now.items() if n != step.chosen.effect}) / whole
            for step in steps
        }
        steps = sorted(steps, key=lambda step: -worth[step.chosen.effect])
        if worth[steps[-1].chosen.effect] > 1 / LOWERS:
            break
        without = Isolator({n: v for n, v in now.items() if n != steps[-1].chosen.effect})
        steps, last = steps[:-1], rank(without)
    return steps, last


def _error(by_noise: FitData, effects: Mapping[str, Mapping[str, float]]) -> float:
    """N, of the force of a model with these effects, fitted from these values."""
    whole = weighted_fit(by_noise.observations, Isolator(effects))
    return error(whole.data, whole.fit)


def _named(steps: Sequence[Step]) -> str:
    return ", ".join(f"step {number}: {step.chosen.effect}" for number, step in enumerate(steps, 1))


def _is_off(ranking: Ranking, fit: Fit, given: Isolator) -> bool:
    """True if the fitted values lower the error of the given ones by an amount that matters."""
    left = chi_square(ranking.data, given)
    evident = (left - fit.chi_square) / ranking.inflation > DECISIVE + len(fit.free) * np.log(ranking.independent)
    return bool(evident and left > (1 + WORTH) ** 2 * fit.chi_square)


def _outcome(steps: Sequence[Step], before: Unexplained, left: Unexplained, *, is_supported: bool) -> Outcome:
    """Outcome; an effect that the records support but that was not added leaves an unknown cause."""
    if not steps:
        return Outcome.UNKNOWN if before.is_there or is_supported else Outcome.NOTHING_MISSING
    if left.is_there and left.excess > MOST_UNEXPLAINED * before.excess:
        return Outcome.UNKNOWN
    sets = [{one.effect for one in step.alike} for step in steps]
    families = [{EFFECTS[name].family for name in one} for one in sets]
    if all(len(one) == 1 for one in sets):
        # one law of another form may look like two of its family, but then leaves something
        is_one_law = left.is_there and len(set().union(*families)) < len(steps)
        return Outcome.FAMILY if is_one_law else Outcome.EFFECT
    return Outcome.FAMILY if all(len(one) == 1 for one in families) else Outcome.ONE_OF_SET
