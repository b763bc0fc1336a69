"""A model made better: diagnosed, and given what the records ask for, until they ask for nothing more.

An effect is taken only if it lowers the error on the earthquakes left out too, where there are any; with something
unknown missing none is, since the nearest that is known is then nearly always significant, and wrong.
"""

from collections.abc import Collection
from dataclasses import dataclass

from core.diagnosis.missing_effects import Outcome
from core.fitting.fit import Fit
from service.jobs.progress import Tell
from service.models.model_file import ModelFile
from service.models.workbench.diagnosing import Diagnosed, diagnose
from service.models.workbench.records import Records
from service.models.workbench.refit import model_of
from service.models.workbench.versions import Version, helps

ROUNDS = 3
"""Diagnoses at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Improved:
    """What came of it."""

    rounds: tuple[Diagnosed, ...]
    model: ModelFile
    fit: Fit
    inflation: float
    """Of its variances, see service.models.workbench.refit.Refit."""
    taken: tuple[str, ...]
    """Effects, in the order in which they were added."""
    ended: str
    """Why it went no further, in words."""
    versions: tuple[Version, ...]
    """As given, refitted, then with each effect that was taken."""
    records: Records


def improve(
    given: ModelFile, parent: str, records: Records, tell: Tell, effects: Collection[str] | None = None
) -> Improved:
    """Diagnose and add, by turns.

    Args:
        given: the model.
        parent: its name, for the one made from it.
        records: of the building.
        tell: for who waits.
        effects: names of those that may be added; None for all there are.

    Raises:
        RecordError: no record is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    rounds: list[Diagnosed] = []
    taken: list[str] = []
    versions: list[Version] = []
    model, ended = given, "every diagnosis that was made asked for more; another `menshin model improve` would go on"
    while len(rounds) < ROUNDS:
        found = diagnose(model, parent, records, tell, effects)
        rounds.append(found)
        count = _taken(found)
        versions += found.versions[0 if not versions else 2 : 2 + count]
        taken += [stage.effect for stage in found.stages[:count]]
        fit, inflation = _fit(found, count)
        model = model_of(fit, inflation, given, parent, records)
        if reason := _ended(found, count):
            ended = reason
            break
    return Improved(tuple(rounds), model, fit, inflation, tuple(taken), ended, tuple(versions), records)


def _taken(found: Diagnosed) -> int:
    """How many of the effects asked for are worth taking, from the first on.

    With something unknown missing the next best name is a stand-in: only earthquakes left out can tell that it is a
    good one.
    """
    is_unknown = found.diagnosis.outcome is Outcome.UNKNOWN
    if found.suspects or (is_unknown and not found.records.left_out):
        return 0
    count = 0
    for before, after in zip(found.versions[1:], found.versions[2:], strict=False):
        if not helps(before, after, found.records):
            break
        count += 1
    return count


def _fit(found: Diagnosed, count: int) -> tuple[Fit, float]:
    """With the first effects that were asked for, and the inflation of its variances."""
    if not count:
        return found.diagnosis.refitted, found.diagnosis.first.inflation
    return found.stages[count - 1].fit, found.stages[count - 1].inflation


def _ended(found: Diagnosed, count: int) -> str | None:
    """Why nothing more is to be done; None if another diagnosis may find more."""
    if found.suspects:
        return f"something is wrong before the layer is asked ({found.outcome}): `menshin model diagnose` tells what"
    if found.diagnosis.outcome is Outcome.UNKNOWN and not count:
        return "something is missing that no known effect explains: nothing was added for it"
    if count < len(found.stages):
        return f"{found.stages[count].effect} was asked for, but does not lower the error on earthquakes left out"
    return None if found.stages else "nothing more is asked for"
