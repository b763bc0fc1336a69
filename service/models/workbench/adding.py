"""A model with one more effect, everything fitted anew, and what that does to the error."""

from dataclasses import dataclass

from core.diagnosis.ranking import ranked
from core.errors import ModelError, RecordError
from core.fitting.fit import Fit
from core.fitting.layer_columns import Evidence
from service.jobs.progress import Tell
from service.models.model_file import ModelFile
from service.models.workbench.answers import answers
from service.models.workbench.candidates import Candidate, candidates
from service.models.workbench.records import Records
from service.models.workbench.refit import model_of
from service.models.workbench.versions import Version


@dataclass(frozen=True, slots=True, eq=False)
class Added:
    """What came of it."""

    given: ModelFile
    model: ModelFile
    """With the effect."""
    effect: str
    candidate: Candidate
    fit: Fit
    inflation: float
    records: Records
    versions: tuple[Version, ...]
    """As given, refitted without the effect, and with it."""


def add(effect: str, given: ModelFile, parent: str, records: Records, tell: Tell) -> Added:
    """An effect that the model has not, from the best places to begin.

    Args:
        effect: its name.
        given: the model.
        parent: its name, for the one made from it.
        records: of the building.
        tell: for who waits.

    Raises:
        RecordError: no record is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    if not records.fitted:
        raise RecordError("every earthquake is held out; one to fit to would do")
    tell(f"fitting the model with {effect}", 0, 2)
    by_noise = Evidence.by_noise(sorted(records.fitted, key=lambda one: one.start))
    ranking = ranked(by_noise, given.isolator, (effect,))
    tried, diverging = candidates(ranking, records)
    for one in (*ranking.dropped, *diverging):
        raise ModelError(f"{one.effect} cannot be added: {one.reason}")
    (candidate,) = tried
    tell("driving the versions by the motion and by the ground alone", 1, 2)
    versions = (
        Version("as given", answers(given.isolator, records)),
        Version("refitted", answers(ranking.base.model, records)),
        Version(f"with {effect}", answers(candidate.fit.model, records)),
    )
    tell("added", 2, 2)
    model = model_of(candidate.fit, ranking.inflation, given, parent, records)
    return Added(given, model, effect, candidate, candidate.fit, ranking.inflation, records, versions)
