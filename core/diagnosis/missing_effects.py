"""Physical effects that a model lacks, and whether adding them helps.

Effects are added one at a time, each time the best of those that are left, until the records ask for no more. Where
there are several, each is then compared with all others once again. Whatever no effect explains is reported beside
every name: if the library lacks the true effect, a wrong name is nearly always significant.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from core.diagnosis.plausibility import objection
from core.diagnosis.ranking import DECISIVE, Dropped, Ranking, ScoredCandidate, ranked
from core.diagnosis.unexplained import explained_share
from core.effects import EFFECTS
from core.errors import RecordError
from core.fitting.data import FitData
from core.fitting.fit import Fit, chi_square, error, weighted_fit
from core.fitting.observation import Observation
from core.model.isolator import Isolator

MOST_EFFECTS = 3
"""That are added in one diagnosis."""
FEW_EFFECTS = 2
"""That are told by their names; where more are asked for, it is rather one that the library does not have."""
STRUCTURED = 0.05
"""Share of the residual's power that a regression foretells, from which on something is left to explain."""
ABOVE_FLOOR = 1.25
"""Residual over noise floor, from which on something is left to explain beside an effect that was found."""
ABOVE_COLOURED = 2.0
"""The same where no effect takes anything: noise that is stronger at low frequencies than at the high ones, where it is
seen, looks like that, and nothing in it depends on the motion."""
WORTH = 0.05
"""Of the residual: other values of the same parameters that take less than this away are not worth a fit."""
ANOTHER = 0.3
"""Of what is left over, its power: an effect beside one that was found must take more, since a law that is not quite
the true one leaves what others take a little of;"""
ANOTHER_OF_LITTLE, MOST_OF_IT = 0.1, 0.6
"""or more than the first of these and, where what is left stands out of the noise by"""
STANDS_OUT = 1.1
"""noise floors, more than the second of what is beyond the noise: so a weak second effect is told from the rest of a
law that is not quite the true one."""
LOWERS = 0.98
"""Of the force's error in N: what an effect must lower it to, else it is not named."""
LITTLE_TAKEN = 0.5
"""Share of the error beyond the noise that the library's effects leave, from which on the cause is unknown."""


class Outcome(Enum):
    """What a diagnosis comes to."""

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
    """Of the candidates, the model as it was before."""
    chosen: ScoredCandidate
    alike: tuple[ScoredCandidate, ...]
    """Candidates that the records cannot distinguish from the best and against which nothing speaks; the chosen one
    is first. Where something speaks against all of them, those that are doubtful only."""


@dataclass(frozen=True, slots=True, eq=False)
class Unexplained:
    """Whether something is left that no effect took."""

    share: float
    """Of the residual's power that a regression foretells; see core.diagnosis.unexplained."""
    noise_ratio: float
    """Residual over noise floor, root mean square over the records."""
    allowed: float
    """The largest of it that noise may make."""

    @property
    def is_there(self) -> bool:
        """Beyond doubt."""
        return self.noise_ratio > self.allowed or (self.share > STRUCTURED and self.noise_ratio > 1.0)

    @property
    def excess(self) -> float:
        """Power beyond the noise, over the noise's."""
        return max(self.noise_ratio**2 - 1, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """What the records ask for."""

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
    """Of the refitted model."""
    unexplained: Unexplained
    """Of the model with all effects."""
    first: Ranking
    """Of the candidates for the refitted model."""
    last: Ranking
    """Of the candidates for the model with all effects."""

    @property
    def dropped(self) -> tuple[Dropped, ...]:
        """Effects that could not be judged, in any of the rankings, by their names."""
        rankings = (self.first, *(step.ranking for step in self.steps), self.last)
        each = {one.effect: one for ranking in rankings for one in ranking.dropped}
        return tuple(each[name] for name in sorted(each))

    @property
    def is_unknown(self) -> bool:
        """Whether something is at work that the library's effects, a few of them, do not explain."""
        return self.unexplained.is_there or len(self.steps) > FEW_EFFECTS


def _to_nobody(found: str) -> None:
    """Nobody waits."""


def diagnosed(
    observations: Sequence[Observation],
    model: Isolator,
    effects: Collection[str] | None = None,
    report_step: Callable[[str], None] = _to_nobody,
) -> Diagnosis:
    """Of a model and the records of some earthquakes.

    Args:
        observations: of the earthquakes.
        model: effects and values.
        effects: names of those that may be added; None for all there are.
        tell: called after each ranking that asks for another one, with what was found so far, in words.

    Raises:
        RecordError: no observation.
        ModelError: a model's force grew beyond all bounds.
    """
    if not observations:
        raise RecordError("no earthquake is left for the diagnosis; give one that was analysed in this direction")
    effects = tuple(EFFECTS) if effects is None else effects
    by_noise = FitData.by_noise(sorted(observations, key=lambda one: one.start))
    first = last = ranked(by_noise, model, _absent(effects, model))
    steps: list[Step] = []
    while (more := _more(steps, last)) is not None:
        steps.append(more)
        report_step(f"{_named(steps)}; looking for another effect")
        now = steps[-1].chosen.fit.model
        last = ranked(by_noise, now, _absent(effects, now))
    if len(steps) > 1:
        steps, last = _swapped(by_noise, steps, last, effects, report_step)
    steps, last = _without_idle(by_noise, steps, last, effects)
    allowed = ABOVE_FLOOR if steps else ABOVE_COLOURED
    before, left = (_unexplained(ranking, allowed) for ranking in (first, last))
    outcome = _outcome(steps, before, left, is_asked=bool(first.asked_for))
    if outcome is Outcome.NOTHING_MISSING and _is_off(first, model):
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


def _more(steps: Sequence[Step], last: Ranking) -> Step | None:
    """One more effect; None if there is none to add."""
    step = _step(last) if len(steps) < MOST_EFFECTS else None
    return step if step is not None and (not steps or _is_another(step)) else None


def _step(ranking: Ranking) -> Step | None:
    """The best effect that is asked for; one against which something speaks only where it does against all."""
    judged = [(one, objection(one.effect, one.fit, ranking.data.observations)) for one in ranking.asked_for]
    plausible = [one for one, against in judged if against is None]
    named = plausible or [one for one, against in judged if against is not None and not against.is_impossible]
    return Step(ranking, named[0], tuple(named)) if named else None


def _is_another(step: Step) -> bool:
    """Whether the chosen candidate is an effect of its own beside those that were found."""
    ranking, best = step.ranking, step.chosen.fit
    taken = 1 - best.chi_square / ranking.base.chi_square
    before, after = (ranking.noise_ratio(fit) for fit in (ranking.base, best))
    beyond = max(before**2 - 1, 0.0)
    is_most = before > STANDS_OUT and before**2 - after**2 > MOST_OF_IT * beyond
    return taken > ANOTHER or (taken > ANOTHER_OF_LITTLE and is_most)


def _swapped(
    by_noise: FitData, steps: list[Step], last: Ranking, effects: Collection[str], report_step: Callable[[str], None]
) -> tuple[list[Step], Ranking]:
    """Each effect but the last one added, once more against all others, now that those after it are there.

    It goes if nothing is asked for in its place, and if another is, that comes instead.
    """
    for step in tuple(steps[:-1]):
        report_step(f"{_named(steps)}; asking again for {step.chosen.effect}, beside the later ones")
        without = Isolator({n: v for n, v in last.base.model.effects.items() if n != step.chosen.effect})
        ranking = ranked(by_noise, without, _absent(effects, without))
        again = _step(ranking)
        if again is not None and step.chosen.effect in {one.effect for one in again.alike}:
            continue
        place = steps.index(step)
        instead = [] if again is None else [again]
        steps = [*steps[:place], *instead, *steps[place + 1 :]]
        now = instead[0].chosen.fit.model if instead else ranking.base.model
        last = ranked(by_noise, now, _absent(effects, now))
    return steps, last


def _without_idle(
    by_noise: FitData, steps: list[Step], last: Ranking, effects: Collection[str]
) -> tuple[list[Step], Ranking]:
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
        steps, last = steps[:-1], ranked(by_noise, without, _absent(effects, without))
    return steps, last


def _error(by_noise: FitData, effects: Mapping[str, Mapping[str, float]]) -> float:
    """N, of the force of a model with these effects, fitted from these values."""
    found = weighted_fit(by_noise.observations, Isolator(effects))
    return error(found.data, found.fit)


def _named(steps: Sequence[Step]) -> str:
    return ", ".join(f"step {number}: {step.chosen.effect}" for number, step in enumerate(steps, 1))


def _is_off(ranking: Ranking, given: Isolator) -> bool:
    """Whether the given values leave more than the fitted ones do, and more than is worth leaving."""
    data, fit = ranking.data, ranking.base
    left = chi_square(data, given)
    evident = (left - fit.chi_square) / ranking.inflation > DECISIVE + len(fit.free) * np.log(ranking.independent)
    return bool(evident and left > (1 + WORTH) ** 2 * fit.chi_square)


def _absent(effects: Collection[str], model: Isolator) -> tuple[str, ...]:
    return tuple(name for name in sorted(effects) if name not in model.effects)


def _unexplained(ranking: Ranking, allowed: float) -> Unexplained:
    share = explained_share(ranking.data, ranking.base)
    return Unexplained(share, ranking.noise_ratio(ranking.base), allowed)


def _outcome(steps: Sequence[Step], before: Unexplained, left: Unexplained, *, is_asked: bool) -> Outcome:
    """What it comes to; an effect that is asked for but was not added leaves something unknown."""
    if not steps:
        return Outcome.UNKNOWN if before.is_there or is_asked else Outcome.NOTHING_MISSING
    if left.is_there and left.excess > LITTLE_TAKEN * before.excess:
        return Outcome.UNKNOWN
    sets = [{one.effect for one in step.alike} for step in steps]
    families = [{EFFECTS[name].family for name in one} for one in sets]
    if all(len(one) == 1 for one in sets):
        # one law of another form may look like two of its family, but then leaves something
        is_one_law = left.is_there and len(set().union(*families)) < len(steps)
        return Outcome.FAMILY if is_one_law else Outcome.EFFECT
    return Outcome.FAMILY if all(len(one) == 1 for one in families) else Outcome.ONE_OF_SET
