"""What does a model lack, by all records, and what does adding it do to the error on earthquakes left out?"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.comparison import compare_forces, force_misfit
from core.diagnosis import Diagnosis, Step, diagnosed
from core.effects import EFFECTS
from core.errors import RecordError
from core.first_model import first_model
from core.fitting import Fit
from core.isolator import Isolator
from core.misfit import Misfit
from core.plausibility import implausible
from core.ranking import Judged, Ranking
from core.suspect import Suspect
from core.suspicion import suspicions
from core.weighed_fit import weighed_fit
from service.model_file import ModelFile
from service.progress import Tell, silent
from service.workbench.answers import answers
from service.workbench.held import Held, held
from service.workbench.records import Records
from service.workbench.refit import deviations, model_of
from service.workbench.suspicions import first_cause
from service.workbench.versions import FITTED, LEFT_OUT, Version, groups


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """An effect that was tried."""

    effect: str
    fit: Fit
    delta_bic: float
    """Below -10: the records ask for it."""
    in_set: bool
    """Whether it is the best, or the records do not tell it from the best."""
    after: Misfit
    """N, of the force, where it was fitted."""
    floors: float
    """What is left in multiples of the noise floor, each earthquake in its own, as the ranking has it."""
    after_left_out: Misfit | None
    implausible: str | None
    """Why a layer cannot be so."""
    deviations: Mapping[str, float]
    """Of its own parameters."""

    @property
    def family(self) -> str:
        """Its effect's."""
        return EFFECTS[self.effect].family


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """The model with the first effects that were asked for."""

    effect: str
    """The last one of them."""
    step: Step
    """Against which others it was chosen."""
    fit: Fit
    inflation: float
    """Of its variances, see service.workbench.refit.Refit."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosed:
    """What came of it."""

    given: ModelFile
    model: ModelFile
    """With all that was added."""
    records: Records
    diagnosis: Diagnosis
    refitted: Held
    """The model as it was given but for its values, held against all records."""
    candidates: tuple[Candidate, ...]
    """For the refitted model, the best first."""
    suspects: tuple[Suspect, ...]
    """What is wrong before the layer is asked."""
    stages: tuple[Stage, ...]
    """Of each effect that was added."""
    versions: tuple[Version, ...]
    """As given, refitted, then those of the stages."""

    @property
    def outcome(self) -> str:
        """One word: what is wrong before the layer is asked, else what the layer lacks."""
        cause = first_cause(self.suspects)
        return self.diagnosis.outcome.value if cause is None else cause.value


def diagnose(
    given: ModelFile, parent: str, records: Records, tell: Tell, effects: Collection[str] = tuple(EFFECTS)
) -> Diagnosed:
    """Ask every effect that the model has not.

    Args:
        given: the model.
        parent: its name, for one made from it.
        records: of the building.
        tell: for who waits.
        effects: names of those that may be added.

    Raises:
        RecordError: no record is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    if not records.fitted:
        raise RecordError("every earthquake is held out; one to fit to would do")
    tell("asking every effect", 0, 4)
    found = diagnosed(records.fitted, given.isolator, effects, lambda so_far: tell(so_far, 0, 4))
    tell("trying them on every earthquake", 1, 4)
    tried = candidates(found.first, records)
    tell("looking at where the model fails", 2, 4)
    refitted = held(model_of(found.refitted, found.first.inflation, given, parent, records), records, silent)
    tell("driving the versions by the motion and by the ground alone", 3, 4)
    staged = stages(found, records)
    versions = (
        Version("as given", answers(given.isolator, records)),
        Version("refitted", refitted.answers),
        *(
            Version(named(staged[: number + 1]), answers(stage.fit.model, records))
            for number, stage in enumerate(staged)
        ),
    )
    tell("diagnosed", 4, 4)
    model = model_of(found.after, found.last.inflation, given, parent, records)
    return Diagnosed(given, model, records, found, refitted, tried, _suspects(found, records), staged, versions)


def _suspects(found: Diagnosis, records: Records) -> tuple[Suspect, ...]:
    """Of the mass too, where the design's model is all that the layer has."""
    is_of_design = set(found.given.effects) == set(first_model(records.description).isolator.effects)
    explains = is_of_design and not found.steps and not found.unexplained.is_there
    return suspicions(records.analyses, records.description, found.refitted if explains else None)


def stages(found: Diagnosis, records: Records) -> tuple[Stage, ...]:
    """The model with the first of the effects, the first two of them ... and all.

    Where an effect took another's place the models before it never were: they are fitted here.
    """
    added: list[str] = []
    made: list[Stage] = []
    for step in found.steps:
        added.append(step.chosen.effect)
        wanted = {*found.given.effects, *added}
        if set(step.chosen.fit.model.effects) == wanted:
            fit, inflation = step.chosen.fit, step.ranking.inflation
        else:
            whole = found.after.model.effects
            own = weighed_fit(records.fitted, Isolator({n: v for n, v in whole.items() if n in wanted}))
            fit, inflation = own.fit, own.inflation
        made.append(Stage(step.chosen.effect, step, fit, inflation))
    return tuple(made)


def candidates(ranking: Ranking, records: Records) -> tuple[Candidate, ...]:
    """All that were tried, each on every earthquake, the best first."""
    alike = {one.effect for one in ranking.asked_for}
    return tuple(_candidate(one, ranking, records, one.effect in alike) for one in ranking.candidates)


def over_floor(fit: Fit, ranking: Ranking) -> float:
    """What a fit leaves in multiples of the noise floor, each record in its own."""
    return float(np.sqrt(np.mean((ranking.left(fit) / ranking.floor) ** 2)))


def _candidate(judged: Judged, ranking: Ranking, records: Records, in_set: bool) -> Candidate:
    parted, model = groups(records), judged.fit.model
    forces = compare_forces(model, records.observations, records.band)
    errors = {
        group: force_misfit([one for one in forces if one.observation.name in names]) for group, names in parted.items()
    }
    return Candidate(
        effect=judged.effect,
        fit=judged.fit,
        delta_bic=judged.delta_bic,
        in_set=in_set,
        after=errors[FITTED],
        floors=over_floor(judged.fit, ranking),
        after_left_out=errors.get(LEFT_OUT),
        implausible=implausible(judged.effect, judged.fit, records.fitted),
        deviations=deviations(judged.fit, ranking.inflation).get(judged.effect, {}),
    )


def named(staged: Sequence[Stage]) -> str:
    """Of a version, by what was added."""
    return f"with {', '.join(stage.effect for stage in staged)}"
