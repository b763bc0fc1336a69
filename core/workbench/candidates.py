"""Effects that were tried on a model, and the model with each effect that a diagnosis added."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from core.comparison.compared import compare_forces, force_misfit
from core.comparison.misfit import Misfit
from core.concurrency import at_once
from core.diagnosis.effect_search import Step
from core.diagnosis.missing_effects import Diagnosis
from core.diagnosis.plausibility import implausible
from core.diagnosis.ranking import Dropped, Ranking, ScoredCandidate
from core.effects import EFFECTS
from core.errors import ModelError
from core.fitting.fit import Fit, weighted_fit
from core.frozen import FrozenDict
from core.model.isolator import Isolator
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes, Version, lowers, model_errors
from core.workbench.fitting import deviations

AS_GIVEN, REFITTED = "as given", "refitted"
"""Names of the versions that come before the added effects."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """An effect that was tried."""

    effect: str
    fit: Fit
    delta_bic: float
    """The records support it below -10."""
    in_set: bool
    """True if it is the best, or cannot be distinguished from the best, and is plausible."""
    after: Misfit
    """N, of the force, where it was fitted."""
    noise_ratio: float
    """Remaining error over the noise, each earthquake by its own noise, weighed as the ranking does."""
    after_held_out: Misfit | None
    """N, of the force in held-out earthquakes."""
    implausible: str | None
    """Reason why a layer cannot have this effect."""
    std: Mapping[str, float]
    """Standard deviations of its own parameters, SI units."""

    @property
    def family(self) -> str:
        """Family of the effect."""
        return EFFECTS[self.effect].family


def candidates(ranking: Ranking, earthquakes: Earthquakes) -> tuple[tuple[Candidate, ...], tuple[Dropped, ...]]:
    """All effects of a ranking, each on every earthquake, the best first; and those whose force diverged in one."""
    alike = {one.effect for one in ranking.supported}

    def tried(one: ScoredCandidate) -> Candidate | Dropped:
        try:
            return _candidate(one, ranking, earthquakes, one.effect in alike)
        except ModelError as error:
            return Dropped(one.effect, str(error))

    every = tuple(at_once(tried, ranking.candidates))
    return (
        tuple(one for one in every if isinstance(one, Candidate)),
        tuple(one for one in every if isinstance(one, Dropped)),
    )


def _candidate(scored: ScoredCandidate, ranking: Ranking, earthquakes: Earthquakes, in_set: bool) -> Candidate:
    forces = compare_forces(scored.fit.model, earthquakes.observations, earthquakes.band)
    errors = {
        group: force_misfit([one for one in forces if one.observation.name in names])
        for group, names in earthquakes.groups.items()
    }
    against = implausible(scored.effect, scored.fit, earthquakes.fitted)
    return Candidate(
        effect=scored.effect,
        fit=scored.fit,
        delta_bic=scored.delta_bic,
        in_set=in_set and against is None,
        after=errors[FITTED],
        noise_ratio=ranking.noise_ratio(scored.fit),
        after_held_out=errors.get(HELD_OUT),
        implausible=against,
        std=deviations(scored.fit, ranking.inflation).get(scored.effect, FrozenDict({})),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """The model with the first effects that a diagnosis added."""

    effect: str
    """The last one of them."""
    step: Step
    """The choice of this effect, with its rivals."""
    fit: Fit
    inflation: float
    """Ratio of the variances to those that the measurement's noise alone would cause."""


def stages(
    diagnosis: Diagnosis, refitted: Version, earthquakes: Earthquakes
) -> tuple[tuple[Stage, ...], tuple[Version, ...]]:
    """Stages of the model, each of which lowers the error of whole histories, and the versions, the refitted one first.

    The effects are in the order of the diagnosis as far as possible: one may help only beside another.

    Args:
        diagnosis: of a model.
        refitted: the version with the model's own effects, fitted.
        earthquakes: of the diagnosis.
    """
    left, staged, versions = diagnosis.steps, list[Stage](), [refitted]

    def tried(step: Step) -> tuple[Stage, Version]:
        made = _stage(step, staged, diagnosis, earthquakes)
        name = f"with {', '.join(one.effect for one in (*staged, made))}"
        return made, Version(name, model_errors(made.fit.model, earthquakes))

    while lowering := next((one for one in map(tried, left) if lowers(versions[-1], one[1], earthquakes)), None):
        staged.append(lowering[0])
        versions.append(lowering[1])
        left = tuple(step for step in left if step is not lowering[0].step)
    return tuple(staged), tuple(versions)


def _stage(step: Step, before: Sequence[Stage], diagnosis: Diagnosis, earthquakes: Earthquakes) -> Stage:
    """The model with the effects of some stages and with the one of a step.

    Where the diagnosis never fitted this model, because an effect took another's place, it is fitted here.
    """
    wanted = {*diagnosis.given.effects, *(one.effect for one in before), step.chosen.effect}
    if set(step.chosen.fit.model.effects) == wanted:
        return Stage(step.chosen.effect, step, step.chosen.fit, step.ranking.inflation)
    whole = diagnosis.after.model.effects
    own = weighted_fit(earthquakes.fitted, Isolator({n: v for n, v in whole.items() if n in wanted}))
    return Stage(step.chosen.effect, step, own.fit, own.inflation)
