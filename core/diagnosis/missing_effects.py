"""Physical effects that a model lacks, and whether adding them helps.

Effects are added one at a time, each time the best of those that are left, until the records support no more. Where
these leave something, pairs are then searched together, since several effects may have one stand-in. Where there are
three, each is compared with all others once again and more are added, as long as the force's error falls. Whatever no
effect explains is reported beside every name: if the library lacks the true effect, a wrong name is nearly always
significant.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from enum import Enum

from core.diagnosis.effect_search import (
    ABOVE_NOISE,
    FEW_RATIOS,
    MOST_EFFECTS,
    Step,
    best_step,
    is_off,
    searched,
    unreported,
)
from core.diagnosis.naming import (
    NEARLY,
    are_of_one_kind,
    certain,
    earning,
    left_out,
    looked_like_two,
    takes_nearly_all,
    with_near,
    with_plausible,
)
from core.diagnosis.ranking import Dropped, Ranking, Rankings, ranked
from core.diagnosis.unexplained import ABOVE_COLOURED, ABOVE_FLOOR, Unexplained, unexplained
from core.diagnosis.worth import Judge, NoiseRatios, Worth, worth
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, check_motion
from core.fitting.observation import Observation
from core.model.isolator import Isolator

FEW_EFFECTS = 2
"""Largest number of effects that are named; if more seem missing, the true effect is rather not in the library. Chosen
on even seeds of benchmarks.diagnosis."""
MOST_UNEXPLAINED = 0.5
"""Share of the excess error that the library's effects leave, from which on the cause is unknown. Chosen on even seeds
of benchmarks.diagnosis."""


BEGINNING = "trying every effect"
"""The first step of a diagnosis, in words."""


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
    """Noise ratios of the refitted model."""
    ratios_after: NoiseRatios
    """Noise ratios of the model with all effects."""

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
        each = {one.effect: one for ranking in self._rankings for one in ranking.dropped}
        return tuple(each[name] for name in sorted(each))

    @property
    def untried(self) -> tuple[str, ...]:
        """Effects that were in no ranking, because the records are explained without them."""
        tried = {one.effect for ranking in self._rankings for one in ranking.candidates}
        tried |= {one.effect for one in self.dropped}
        return tuple(name for name in self.first.untried if name not in tried)

    @property
    def _rankings(self) -> tuple[Ranking, ...]:
        return (self.first, *(step.ranking for step in self.steps), self.last)

    @property
    def is_unknown(self) -> bool:
        """True if a few of the library's effects do not explain the residual."""
        return self.unexplained.is_there or len(self.steps) > FEW_EFFECTS


class _Course:
    """Course of a diagnosis. The number of its rankings is not known: each takes half of the way that is left."""

    def __init__(self, report: Callable[[str, float], None], doing: str) -> None:
        self._report, self._doing, self._rankings, self._share = report, doing, 0, 0.0

    def step(self, doing: str) -> None:
        """Begin what is described in words."""
        self._doing = doing
        self._report(doing, self._share)

    def ranking(self) -> Callable[[float], None]:
        """Begin another ranking; what is returned reports its share."""
        self._rankings += 1
        left = 0.5**self._rankings  # after this ranking; before it, twice as much

        def report(share: float) -> None:
            self._share = max(self._share, 1 - left * (2 - share))  # a ranking may begin again from calmer values
            self._report(self._doing, self._share)

        return report


def diagnosed(
    observations: Sequence[Observation],
    model: Isolator,
    effects: Collection[str] | None = None,
    report: Callable[[str, float], None] = unreported,
    held_out: Sequence[Observation] = (),
    doing: str = BEGINNING,
) -> Diagnosis:
    """Diagnose a model by the records of several earthquakes.

    Args:
        observations: of the earthquakes.
        model: effects and values.
        effects: names of those that may be added; None for all there are.
        report: called with the effects so far, in words, and the share of the work that is done, an estimate.
        held_out: of other earthquakes, which nothing is fitted to: an effect must explain them too.
        doing: the first step, in words.

    Raises:
        RecordError: no observation, or none with motion and force.
        ModelError: a model's force grew beyond all bounds.
    """
    check_motion(observations)
    by_noise = FitData.by_noise(sorted(observations, key=lambda one: one.start))
    allowed_effects = sorted(EFFECTS if effects is None else effects)

    course = _Course(report, doing)
    first = ranked(by_noise, model, _others(allowed_effects, model), report=course.ranking())
    made = Rankings([first])

    def rank(now: Isolator, known: Isolator | None = None) -> Ranking:
        others = _others(allowed_effects, now) if len(now.effects) < len(model.effects) + MOST_EFFECTS else []
        return made.known(now, known) or made.add(
            ranked(by_noise, now, others, known, first.base.model, course.ranking())
        )

    steps, last = searched(by_noise, first, allowed_effects, rank, course.step)
    judge = Judge.of(observations, held_out)
    steps, idle, last = earning(by_noise, judge, steps, last, rank)
    best = best_step(first)
    is_one_law = best is not None and looked_like_two(best, steps, idle, last)
    if best is not None and is_one_law:
        others = [one for one in (*steps, *idle) if one.chosen.effect != best.chosen.effect]
        steps, more, last = earning(by_noise, judge, [best], rank(best.chosen.fit.model), rank)
        idle = [*more, *others]
    steps, rest, last = certain(by_noise, judge, steps, first, last, rank)
    idle = [*rest, *idle]
    if first.candidates and not last.candidates:  # to which no effect may be added
        last = ranked(by_noise, last.base.model, _others(allowed_effects, last.base.model), report=course.ranking())
    allowed = ABOVE_FLOOR if steps else ABOVE_COLOURED
    before, left = (unexplained(one.data, one.base, one.noise_ratio(one.base), allowed) for one in (first, last))
    if len(steps) == 1 and (left.is_there or is_one_law):
        steps = [with_near(steps[0])]
    steps = [with_plausible(one, last.base, judge, rank, is_all=not left.is_there) for one in steps]
    after = judge.noise_ratios(last.base.model)
    outcome = outcome_of(steps, before, left, after.held_out or 0.0, is_supported=bool(first.supported))
    if outcome is Outcome.NOTHING_MISSING and is_off(first, first.base, model):
        outcome = Outcome.REFIT
    by_noise.memory.clear()
    return Diagnosis(
        outcome=outcome,
        given=model,
        refitted=first.base,
        steps=tuple(steps),
        idle=left_out(idle, steps),
        after=last.base,
        before=before,
        unexplained=left,
        first=first,
        last=last,
        ratios_before=judge.noise_ratios(first.base.model),
        ratios_after=after,
    )


def outcome_of(
    steps: Sequence[Step], before: Unexplained, left: Unexplained, left_held_out: float, *, is_supported: bool
) -> Outcome:
    """Outcome of a diagnosis. An effect that the records support but that was not added leaves an unknown cause, if
    there was more than noise without it.

    Args:
        steps: effects that earned a name.
        before: structure without them.
        left: structure with them.
        left_held_out: noise ratio with them on held-out records; 0 without any.
        is_supported: whether the records supported any effect at first.
    """
    if not steps:
        is_lacking = is_supported and before.noise_ratio > ABOVE_NOISE
        return Outcome.UNKNOWN if before.is_there or is_lacking else Outcome.NOTHING_MISSING
    if left.is_there and left.excess > MOST_UNEXPLAINED * before.excess:
        return Outcome.UNKNOWN
    sets = [{one.effect for one in step.alike} for step in steps]
    families = [{EFFECTS[name].family for name in one} for one in sets]
    every = set().union(*families)
    is_another_law = max(left.noise_ratio, left_held_out) > FEW_RATIOS
    are_certain = len(every) == 1 or len(steps) == 1 or all(map(takes_nearly_all, steps))
    if is_another_law and (left.excess > (1 - NEARLY) * before.excess or not are_certain):
        return Outcome.UNKNOWN
    if all(len(one) == 1 for one in sets):
        # one law of another form may look like two of its family
        is_one_law = are_of_one_kind(steps) or (left.is_there and len(every) < len(steps))
        return Outcome.FAMILY if is_one_law or is_another_law else Outcome.EFFECT
    return Outcome.FAMILY if all(len(one) == 1 for one in families) else Outcome.ONE_OF_SET


def _others(effects: Sequence[str], model: Isolator) -> list[str]:
    return [name for name in effects if name not in model.effects]
