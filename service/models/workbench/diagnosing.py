"""What does a model lack, by all records, and what does adding it do to the error on earthquakes left out?"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from core.comparison.misfit import Misfit
from core.diagnosis.missing_effects import Diagnosis, Outcome, diagnosed
from core.diagnosis.ranking import Dropped
from core.diagnosis.suspect import Suspect
from core.diagnosis.suspicion import suspicions
from core.effects import EFFECTS
from core.errors import RecordError
from core.fitting.first_model import first_model
from service.jobs.progress import Tell, silent
from service.models.model_file import ModelFile
from service.models.workbench.answers import answers
from service.models.workbench.candidates import Candidate, candidates
from service.models.workbench.held import Held, held
from service.models.workbench.records import Records
from service.models.workbench.refit import model_of
from service.models.workbench.stages import Stage, named, stages
from service.models.workbench.suspicions import first_cause
from service.models.workbench.versions import Version, lowers


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
    diverging: tuple[Dropped, ...] = ()
    """Effects whose force grew beyond all bounds in an earthquake that was left out."""

    @property
    def dropped(self) -> tuple[Dropped, ...]:
        """Effects that could not be judged, with the reason."""
        return (*self.diagnosis.dropped, *self.diverging)

    @property
    def before(self) -> Misfit:
        """N, of the refitted model's force where it was fitted."""
        return self.versions[1].error([one.name for one in self.records.fitted])

    @property
    def outcome(self) -> str:
        """One word: what is wrong before the layer is asked, else what the layer lacks."""
        cause = first_cause(self.suspects)
        return self.diagnosis.outcome.value if cause is None else cause.value


def diagnose(
    given: ModelFile, parent: str, records: Records, tell: Tell, effects: Collection[str] | None = None
) -> Diagnosed:
    """Try every effect that the model does not have.

    Args:
        given: the model.
        parent: its name, for one made from it.
        records: of the building.
        tell: for who waits.
        effects: names of those that may be added; None for all there are.

    Raises:
        RecordError: no record is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    if not records.fitted:
        raise RecordError("every earthquake is held out; one to fit to would do")
    tell("asking every effect", 0, 4)
    offered, diverging = set(EFFECTS if effects is None else effects), list[Dropped]()
    while True:
        found = diagnosed(records.fitted, given.isolator, offered, lambda so_far: tell(so_far, 0, 4))
        tell("trying them on every earthquake", 1, 4)
        tried, dropped = candidates(found.first, records)
        added = {step.chosen.effect for step in found.steps}
        diverging += dropped
        if not added & {one.effect for one in dropped}:
            break
        offered -= {one.effect for one in dropped}
    tell("looking at where the model fails", 2, 4)
    refitted = held(model_of(found.refitted, found.first.inflation, given, parent, records), records, silent)
    tell("driving the versions by the motion and by the ground alone", 3, 4)
    staged = stages(found, records)
    versions = [Version("as given", answers(given.isolator, records)), Version("refitted", refitted.answers)]
    for number, stage in enumerate(staged):
        version = Version(named(staged[: number + 1]), answers(stage.fit.model, records))
        if not lowers(versions[-1], version, records):
            found, staged = _cut(found, staged[:number], records), staged[:number]
            break
        versions.append(version)
    tell("diagnosed", 4, 4)
    fit, inflation = (staged[-1].fit, staged[-1].inflation) if staged else (found.refitted, found.first.inflation)
    model = model_of(fit, inflation, given, parent, records)
    return Diagnosed(
        given=given,
        model=model,
        records=records,
        diagnosis=found,
        refitted=refitted,
        candidates=tried,
        suspects=_suspects(found, records),
        stages=staged,
        versions=tuple(versions),
        diverging=tuple(diverging),
    )


def _cut(found: Diagnosis, kept: Sequence[Stage], records: Records) -> Diagnosis:
    """The diagnosis with the first effects only: the next one does not lower the error of the whole histories."""
    left = diagnosed(records.fitted, kept[-1].fit.model, ()).unexplained if kept else found.before
    return replace(
        found,
        outcome=found.outcome if kept else Outcome.UNKNOWN,
        steps=found.steps[: len(kept)],
        after=kept[-1].fit if kept else found.refitted,
        unexplained=replace(left, allowed=found.unexplained.allowed),
    )


def _suspects(found: Diagnosis, records: Records) -> tuple[Suspect, ...]:
    """Of the mass too, where the design's model is all that the layer has."""
    is_of_design = set(found.given.effects) == set(first_model(records.description).isolator.effects)
    explains = is_of_design and not found.steps and not found.unexplained.is_there
    return suspicions(records.analyses, records.description, found.refitted if explains else None)
