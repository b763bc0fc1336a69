"""What does a diagnosis say, in words for an engineer?"""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from core.diagnosis import Outcome
from core.effects import EFFECTS
from core.misfit import Misfit
from core.ranking import DECISIVE
from service.effect_sheets import explained
from service.workbench.diagnosing import Diagnosed, Stage
from service.workbench.suspicions import words as suspicion_words
from service.workbench.values import percent, rounded
from service.workbench.versions import Version, floors, gain, helps

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
        yield from _stage(stage, found.versions[number + 1], found.versions[number + 2], found)


def _stage(stage: Stage, before: Version, after: Version, found: Diagnosed) -> Iterator[str]:
    alike = [one.effect for one in stage.step.ranking.asked_for]
    beside = [name for name in stage.step.ranking.base.model.effects if name not in found.given.isolator.effects]
    opening = f"Beside {', '.join(beside)}: " if beside else ""
    families = {EFFECTS[name].family for name in alike}
    if len(alike) < 2:
        yield f"{opening}{_titled(stage.effect)} is missing. {_explained(stage)}"
    elif len(families) == 1:
        yield (
            f"{opening}an effect of the family {families.pop()} is missing: "
            f"{' or '.join(map(_titled, alike))}; the records do not tell which."
        )
    else:
        yield f"{opening}one of these is missing, and the records do not tell which: {'; '.join(map(_titled, alike))}."
    names = [one.name for one in found.records.fitted]
    yield _evidence(stage.effect, before.error(names), after.error(names), stage.step.chosen.delta_bic)
    if len(alike) > 1:
        yield f"To tell them apart: {would_tell(alike)}."
    if not helps(before, after, found.records):
        yield f"It helps only the earthquakes it was fitted to: leave {stage.effect}, but for other reasons."


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
        yield f"{_titled(one.effect)} would help by the numbers, but cannot be so: {one.implausible}."
    unseen = ", ".join(dict.fromkeys(name for name, _ in found.diagnosis.refitted.undetermined))
    if unseen:
        yield f"Not determined by these records: {unseen}."


def _best(found: Diagnosed) -> Iterator[str]:
    if found.candidates:
        best = found.candidates[0]
        yield f"The nearest would be {_titled(best.effect)}."
        yield _evidence(best.effect, _before(found), best.after, best.delta_bic)


def _evidence(effect: str, before: Misfit, after: Misfit, delta_bic: float) -> str:
    was, now = (rounded(misfit.rms * 1e-3, 3) for misfit in (before, after))
    bic = f"ΔBIC {rounded(delta_bic, 3)}; below −{DECISIVE:g} the records ask for it"
    return f"With {effect} the force is off by {now} kN instead of {was} kN ({bic})."


def _size(found: Diagnosed) -> str:
    forces = found.versions[1].answers.of([one.name for one in found.records.fitted]).forces
    before = _before(found)
    return (
        f"what the model leaves is {rounded(before.rms * 1e-3, 3)} kN, {percent(before.nrmse)} of the force and "
        f"{floors(forces):.3g} times the noise floor"
    )


def _before(found: Diagnosed) -> Misfit:
    return found.versions[1].error([one.name for one in found.records.fitted])


def _titled(effect: str) -> str:
    return f"{EFFECTS[effect].title} ({effect})"


def _explained(stage: Stage) -> str:
    return explained(EFFECTS[stage.effect], stage.fit.model.effects[stage.effect])


def would_tell(effects: Sequence[str]) -> str:
    """Which records would tell effects from each other."""
    return "; ".join(_hints(effects))


def _hints(effects: Sequence[str]) -> Iterator[str]:
    needs = {need for name in effects for need in EFFECTS[name].needs}
    yield from (hint for need, hint in HINTS.items() if need in needs)
    if any(EFFECTS[name].carried for name in effects):
        yield "a weak earthquake before a strong one, and another after it"
    yield "an earthquake of larger motion, and one of smaller"


HINTS: Mapping[str, str] = MappingProxyType(
    {
        "temperature": "records at temperatures 10 °C apart or more",
        "axial_load": "an earthquake with strong vertical motion, recorded",
        "u_cross": "an earthquake that is strong in both horizontal directions",
        "time": "records from longer before and after",
    }
)
"""By what a law needs."""
