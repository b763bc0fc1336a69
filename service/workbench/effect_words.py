"""What is said of an effect: its name, what it is worth, that it is missing?"""

from collections.abc import Iterator

from core.comparison.misfit import Misfit
from core.diagnosis.ranking import DECISIVE
from core.effects import EFFECTS
from service.workbench.diagnosing import Diagnosed
from service.workbench.effect_sheets import explained
from service.workbench.stages import Stage
from service.workbench.telling_apart import would_tell
from service.workbench.values import rounded
from service.workbench.versions import Version, helps


def titled(effect: str) -> str:
    """What it is, and its name."""
    return f"{EFFECTS[effect].title} ({effect})"


def evidence(effect: str, before: Misfit, after: Misfit, delta_bic: float) -> str:
    """What it does to the error of the force.

    Args:
        effect: its name.
        before: N, without it.
        after: N, with it.
        delta_bic: of the model with it less that without.
    """
    was, now = (rounded(misfit.rms * 1e-3, 3) for misfit in (before, after))
    bic = f"ΔBIC {rounded(delta_bic, 3)}; below −{DECISIVE:g} the records ask for it"
    return f"With {effect} the force is off by {now} kN instead of {was} kN ({bic})."


def missing(stage: Stage, before: Version, after: Version, found: Diagnosed) -> Iterator[str]:
    """That it is, or one that the records do not tell from it.

    Args:
        stage: the model with it.
        before: the version without it.
        after: the version with it.
        found: the diagnosis.
    """
    alike = [one.effect for one in stage.step.ranking.asked_for]
    yield _opening(stage, found) + _named(stage, alike)
    names = [one.name for one in found.records.fitted]
    yield evidence(stage.effect, before.error(names), after.error(names), stage.step.chosen.delta_bic)
    if len(alike) > 1:
        yield f"To tell them apart: {would_tell(alike)}."
    if not helps(before, after, found.records):
        yield f"It helps only the earthquakes it was fitted to: leave {stage.effect}, but for other reasons."


def _opening(stage: Stage, found: Diagnosed) -> str:
    beside = [name for name in stage.step.ranking.base.model.effects if name not in found.given.isolator.effects]
    return f"Beside {', '.join(beside)}: " if beside else ""


def _named(stage: Stage, alike: list[str]) -> str:
    families = {EFFECTS[name].family for name in alike}
    if len(alike) < 2:
        values = stage.fit.model.effects[stage.effect]
        return f"{titled(stage.effect)} is missing. {explained(EFFECTS[stage.effect], values)}"
    if len(families) == 1:
        either = " or ".join(map(titled, alike))
        return f"an effect of the family {families.pop()} is missing: {either}; the records do not tell which."
    return f"one of these is missing, and the records do not tell which: {'; '.join(map(titled, alike))}."
