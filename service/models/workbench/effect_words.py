"""Sentences about one effect: its name, what it does to the error of the force, that it is missing."""

from collections.abc import Iterator, Sequence

from core.comparison.misfit import Misfit
from core.diagnosis.missing_effects import LOWERS
from core.diagnosis.plausibility import implausible
from core.diagnosis.ranking import DECISIVE
from core.effects import EFFECTS
from core.rounding import plain
from service.models.workbench.diagnosing import Diagnosed
from service.models.workbench.effect_sheets import explained
from service.models.workbench.stages import Stage
from service.models.workbench.telling_apart import would_tell
from service.models.workbench.values import percent
from service.models.workbench.versions import LEFT_OUT, Version, groups, helps


def titled(effect: str) -> str:
    """What it is, and its name."""
    return f"{EFFECTS[effect].title} ({effect})"


def lowers(before: Misfit, after: Misfit) -> bool:
    """Whether an effect lowers the force's error by an amount that matters."""
    return after.rms < LOWERS * before.rms


def evidence(effect: str, before: Misfit, after: Misfit, delta_bic: float | None) -> str:
    """What an effect does to the error of the force, as the numbers have it.

    Args:
        effect: its name.
        before: N, without it.
        after: N, with it.
        delta_bic: of the model with it less that without; None where these two models were not compared.
    """
    was, now = (f"{plain(misfit.rms * 1e-3, DIGITS)} kN" for misfit in (before, after))
    if lowers(before, after):
        said = f"With {effect} the error of the force falls from {was} to {now}"
    elif lowers(after, before):
        said = f"{effect} raises the error of the force from {was} to {now}"
    else:
        said = f"{effect} leaves the error of the force as it is: {was} without it, {now} with it"
    if delta_bic is None:
        return f"{_capital(said)}."
    asks = "ask" if delta_bic < -DECISIVE else "do not ask"
    bic = f"ΔBIC {plain(delta_bic, DIGITS)}: the records {asks} for it, the limit is −{DECISIVE:g}"
    return f"{_capital(said)} ({bic})."


def missing(stages: Sequence[Stage], versions: Sequence[Version], found: Diagnosed) -> Iterator[str]:
    """That the last stage's effect is missing, or one that the records cannot distinguish from it; or that it is not
    worth its place, where the error does not fall.

    Args:
        stages: up to the one that is spoken of.
        versions: without any of the effects, then with the first one, the first two, and so on up to it.
        found: the diagnosis.
    """
    stage, (before, after) = stages[-1], versions[-2:]
    names = [one.name for one in found.records.fitted]
    was, now = before.error(names), after.error(names)
    delta = stage.step.chosen.delta_bic if _is_own(stages, found) else None
    if not lowers(was, now):
        yield from _only_elsewhere(stage.effect, before, after, found)
        yield evidence(stage.effect, was, now, delta)
        return
    beside = ", ".join(one.effect for one in stages[:-1])
    alike = [one.effect for one in stage.step.alike]
    yield _capital((f"beside {beside}, " if beside else "") + _named(stage, alike))
    yield evidence(stage.effect, was, now, delta)
    if against := implausible(stage.effect, stage.fit, found.records.fitted):
        yield f"It is doubtful: {against}."
    if len(alike) > 1:
        yield f"What would distinguish them: {would_tell(alike)}."
    if not helps(before, after, found.records):
        yield f"It helps only the earthquakes it was fitted to: do not add {stage.effect} without another reason."


def _only_elsewhere(effect: str, before: Version, after: Version, found: Diagnosed) -> Iterator[str]:
    """What an effect that does not lower the error where it was fitted is worth on earthquakes left out."""
    left_out = groups(found.records).get(LEFT_OUT, ())
    was, now = (version.error(left_out) if left_out else None for version in (before, after))
    if was is None or now is None or not lowers(was, now):
        yield f"{titled(effect)} was tried next and is not worth its place in the model."
        return
    yield (
        f"{titled(effect)} lowers the error of the force on earthquakes left out, from {percent(was.nrmse)} to "
        f"{percent(now.nrmse)}, but not where it was fitted: records of more earthquakes would decide."
    )


def _is_own(stages: Sequence[Stage], found: Diagnosed) -> bool:
    """Whether the effect was judged beside just those that it is presented beside."""
    there = {*found.given.isolator.effects, *(one.effect for one in stages[:-1])}
    return set(stages[-1].step.ranking.base.model.effects) == there


def _named(stage: Stage, alike: list[str]) -> str:
    families = {EFFECTS[name].family for name in alike}
    if len(alike) < 2:
        values = stage.fit.model.effects[stage.effect]
        return f"{titled(stage.effect)} is missing. {explained(EFFECTS[stage.effect], values)}"
    if len(families) == 1:
        either = " or ".join(map(titled, alike))
        return f"an effect of the family {families.pop()} is missing: {either}; the records cannot distinguish them."
    return f"one of these is missing, and the records cannot distinguish them: {'; '.join(map(titled, alike))}."


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


DIGITS = 3
"""Of an error in a sentence: its uncertainty is not known."""
