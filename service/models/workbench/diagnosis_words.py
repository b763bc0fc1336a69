"""The sentences of a diagnosis, for an engineer: each agrees with the numbers beside it."""

from collections.abc import Iterator
from types import MappingProxyType

from core.diagnosis.missing_effects import Outcome
from core.diagnosis.plausibility import objection
from core.diagnosis.ranking import DECISIVE
from core.rounding import plain
from service.models.workbench.diagnosing import Diagnosed
from service.models.workbench.effect_words import evidence, lowers, missing, titled
from service.models.workbench.suspicions import words as suspicion_words
from service.models.workbench.values import percent
from service.models.workbench.versions import floors, gain

RUNNERS_UP = 2
"""Effects that are asked for by the numbers but that something speaks against: at most so many are named."""


def words(found: Diagnosed) -> tuple[str, ...]:
    """Sentences: what is missing, what adding it does, what is open and which records would decide it."""
    before = suspicion_words(found.suspects)
    opening = OPENINGS.get(found.diagnosis.outcome, _missing)(found)
    return (*before, *opening, *_after(found), *_open(found), *_dropped(found))


def _nothing(found: Diagnosed) -> Iterator[str]:
    yield f"No known effect is missing: {_size(found)}, and no effect takes enough of that away."
    yield from _nearest(found)


def _refit(found: Diagnosed) -> Iterator[str]:
    yield "No known effect is missing, but the values are off: fit the model."
    yield f"Fitted, {_size(found)}."
    yield from _nearest(found)


def _missing(found: Diagnosed) -> Iterator[str]:
    for number in range(1, len(found.stages) + 1):
        yield from missing(found.stages[:number], found.versions[1 : number + 2], found)


def _unknown(found: Diagnosed) -> Iterator[str]:
    yield (
        f"Something is missing that no known effect explains: fitted, {_size(found)}, and that has structure. "
        "A name below is no more than the nearest known effect."
    )
    yield from _nearest(found)
    yield from found.refitted.text[1:2]


OPENINGS = MappingProxyType({Outcome.NOTHING_MISSING: _nothing, Outcome.REFIT: _refit, Outcome.UNKNOWN: _unknown})
"""Where no name is given; the others name what is missing."""


def _after(found: Diagnosed) -> Iterator[str]:
    if found.diagnosis.steps:
        yield from gain(found.versions[1], found.versions[-1], found.records)
    if found.diagnosis.steps and found.diagnosis.unexplained.is_there:
        share = percent(max(found.diagnosis.unexplained.share, 0.0))
        yield (
            "With that, the model is still incomplete: it leaves "
            f"{plain(found.diagnosis.unexplained.over_floor, 3)} times the noise floor, {share} of it with structure."
        )


def _open(found: Diagnosed) -> Iterator[str]:
    """What the numbers ask for although something speaks against it, and what the records do not determine."""
    named = {stage.effect for stage in found.stages}
    strange = [one for one in found.candidates if one.implausible and one.delta_bic < -DECISIVE]
    for one in [one for one in strange if one.effect not in named][:RUNNERS_UP]:
        against = objection(one.effect, one.fit, found.records.fitted)
        verdict = "impossible" if against is not None and against.is_impossible else "doubtful"
        yield f"Not proposed, since it is {verdict}: {titled(one.effect)}; {one.implausible}."
    unseen = ", ".join(dict.fromkeys(name for name, _ in found.diagnosis.refitted.undetermined))
    if unseen:
        yield f"Not determined by these records: {unseen}."


def _dropped(found: Diagnosed) -> Iterator[str]:
    for one in found.dropped:
        yield f"{titled(one.effect)} could not be judged: {one.reason}."


def _nearest(found: Diagnosed) -> Iterator[str]:
    """The best effect that lowers the error and that nothing speaks against."""
    plausible = (one for one in found.candidates if not one.implausible and lowers(found.before, one.after))
    best = next(plausible, None)
    if best is None:
        if found.candidates:
            yield "No effect that a layer may have lowers the error of the force."
        return
    yield f"The nearest known effect is {titled(best.effect)}."
    yield evidence(best.effect, found.before, best.after, best.delta_bic)


def _size(found: Diagnosed) -> str:
    forces = found.versions[1].answers.of([one.name for one in found.records.fitted]).forces
    rms, share = plain(found.before.rms * 1e-3, 3), percent(found.before.nrmse)
    return (
        f"the error of the force is {rms} kN, {share} of the force and {plain(floors(forces), 3)} times the noise floor"
    )
