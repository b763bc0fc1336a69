"""What does a diagnosis say, in words for an engineer?"""

from collections.abc import Iterator
from types import MappingProxyType

from core.diagnosis.missing_effects import Outcome
from core.diagnosis.ranking import DECISIVE
from service.workbench.diagnosing import Diagnosed
from service.workbench.effect_words import evidence, missing, titled
from service.workbench.suspicions import words as suspicion_words
from service.workbench.values import percent, rounded
from service.workbench.versions import floors, gain

RUNNERS_UP = 2
"""Effects not asked for, or implausible, that are told of."""


def words(found: Diagnosed) -> tuple[str, ...]:
    """Sentences: what is missing, what adding it does, what is open and what would tell."""
    before = suspicion_words(found.suspects)
    return (*before, *OPENINGS.get(found.diagnosis.outcome, _missing)(found), *_after(found), *_open(found))


def _nothing(found: Diagnosed) -> Iterator[str]:
    yield f"Nothing is missing: {_size(found)}, and no effect takes enough of that away."
    yield from _best(found)


def _refit(found: Diagnosed) -> Iterator[str]:
    yield "No effect is missing; the values are off. A fit would do."
    yield f"Fitted, {_size(found)}."
    yield from _best(found)


def _missing(found: Diagnosed) -> Iterator[str]:
    for number, stage in enumerate(found.stages):
        yield from missing(stage, found.versions[number + 1], found.versions[number + 2], found)


def _unknown(found: Diagnosed) -> Iterator[str]:
    yield (
        f"Something is missing that no known effect explains: fitted, {_size(found)}, and there is structure in it. "
        "A name below is no more than the nearest that is known."
    )
    yield from _best(found)
    yield " ".join(found.refitted.text[1:2])


OPENINGS = MappingProxyType({Outcome.NOTHING_MISSING: _nothing, Outcome.REFIT: _refit, Outcome.UNKNOWN: _unknown})
"""Where no name is given; the others name what is missing."""


def _after(found: Diagnosed) -> Iterator[str]:
    if found.diagnosis.steps:
        yield from gain(found.versions[1], found.versions[-1], found.records)
    if found.diagnosis.steps and found.diagnosis.unexplained.is_there:
        share = percent(max(found.diagnosis.unexplained.share, 0.0))
        yield (
            "Yet something is left that no effect took: "
            f"{rounded(found.diagnosis.unexplained.over_floor, 3)} times the noise floor, {share} of it with structure."
        )


def _open(found: Diagnosed) -> Iterator[str]:
    strange = [one for one in found.candidates if one.implausible and one.delta_bic < -DECISIVE][:RUNNERS_UP]
    for one in strange:
        yield f"{titled(one.effect)} would help by the numbers, but cannot be so: {one.implausible}."
    unseen = ", ".join(dict.fromkeys(name for name, _ in found.diagnosis.refitted.undetermined))
    if unseen:
        yield f"Not determined by these records: {unseen}."


def _best(found: Diagnosed) -> Iterator[str]:
    if found.candidates:
        best = found.candidates[0]
        yield f"The nearest would be {titled(best.effect)}."
        yield evidence(best.effect, found.before, best.after, best.delta_bic)


def _size(found: Diagnosed) -> str:
    forces = found.versions[1].answers.of([one.name for one in found.records.fitted]).forces
    rms, share = rounded(found.before.rms * 1e-3, 3), percent(found.before.nrmse)
    return f"what the model leaves is {rms} kN, {share} of the force and {floors(forces):.3g} times the noise floor"
