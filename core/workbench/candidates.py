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
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes
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


def stages(diagnosis: Diagnosis, earthquakes: Earthquakes) -> tuple[Stage, ...]:
    """The model with the first effect of a diagnosis, with the first two, and so on.

    Where an effect took another's place the diagnosis never fitted the models before it: they are fitted here.
    """
    added: list[str] = []
    made: list[Stage] = []
    for step in diagnosis.steps:
        added.append(step.chosen.effect)
        wanted = {*diagnosis.given.effects, *added}
        if set(step.chosen.fit.model.effects) == wanted:
            fit, inflation = step.chosen.fit, step.ranking.inflation
        else:
            whole = diagnosis.after.model.effects
            own = weighted_fit(earthquakes.fitted, Isolator({n: v for n, v in whole.items() if n in wanted}))
            fit, inflation = own.fit, own.inflation
        made.append(Stage(step.chosen.effect, step, fit, inflation))
    return tuple(made)


def version_name(stages: Sequence[Stage]) -> str:
    """Name of the version with the effects of these stages."""
    return f"with {', '.join(stage.effect for stage in stages)}"
