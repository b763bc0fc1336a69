"""Sentences about one effect: its explanation, the error without and with it, and that it is missing."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from core.comparison.misfit import Misfit
from core.diagnosis.effect_search import LOWERS, Step
from core.diagnosis.plausibility import implausible
from core.diagnosis.ranking import DECISIVE
from core.diagnosis.unexplained import STRUCTURED, Unexplained
from core.diagnosis.worth import Worth
from core.effect import explained
from core.effects import EFFECTS
from core.fitting.fit import Fit
from core.model.isolator import Isolator, parameter, unusual_forms
from core.rounding import plain
from core.units import percent, shown, unit
from core.workbench.candidates import Stage
from core.workbench.earthquakes import HELD_OUT, Earthquakes, Version, helps

DIGITS = 3
"""Digits of an error in a sentence: its uncertainty is not known there."""
LEAST = 1e-3
"""Smallest share that is said as a number: one of its last digit."""
HINTS: Mapping[str, str] = MappingProxyType(
    {
        "temperature": "records at temperatures 10 °C apart or more",
        "axial_load": "an earthquake with strong vertical motion, recorded",
        "u_cross": "an earthquake that is strong in both horizontal directions",
        "time": "records from longer before and after",
    }
)
"""Records that separate effects, by what their laws need."""


def titled(effect: str) -> str:
    """Title of an effect, and its name."""
    return f"{EFFECTS[effect].title} ({effect})"


def lowers_error(before: Misfit, after: Misfit) -> bool:
    """True if an effect lowers the force's error by an amount that matters."""
    return after.rms < LOWERS * before.rms


def evidence(effect: str, before: Misfit, after: Misfit, delta_bic: float | None) -> str:
    """A sentence on the error of the force without and with an effect.

    Args:
        effect: its name.
        before: N, without it.
        after: N, with it.
        delta_bic: of the model with it less that without; None where these two models were not compared.
    """
    was, now = (f"{plain(misfit.rms * 1e-3, DIGITS)} kN" for misfit in (before, after))
    if lowers_error(before, after):
        change = f"With {effect} the error of the force falls from {was} to {now}"
    elif lowers_error(after, before):
        change = f"{effect} raises the error of the force from {was} to {now}"
    else:
        change = f"{effect} leaves the error of the force as it is: {was} without it, {now} with it"
    change = _capital(change)
    if delta_bic is None:
        return f"{change}."
    bic = plain(delta_bic, DIGITS)
    if delta_bic < -DECISIVE:
        return f"{change} (ΔBIC {bic}: the records support it, the limit is −{DECISIVE:g})."
    return f"{change} (ΔBIC {bic}: the records do not support it, the limit is −{DECISIVE:g})."


def missing(
    stages: Sequence[Stage], versions: Sequence[Version], given: Isolator, earthquakes: Earthquakes, final: Fit
) -> Iterator[str]:
    """Sentences on the last stage's effect: it is missing, or one that the records cannot distinguish from it, or it is
    not worth its place where the error does not fall.

    Args:
        stages: up to the effect in question.
        versions: without any of the effects, then with the first one, the first two, and so on up to it.
        given: the model that was diagnosed.
        earthquakes: those it was diagnosed by.
        final: fit of the model with all effects, whose values are stated.
    """
    stage, (before, after) = stages[-1], versions[-2:]
    was, now = before.error(earthquakes.fitted_names), after.error(earthquakes.fitted_names)
    delta = stage.step.chosen.delta_bic if _is_own(stages, given) else None
    if not lowers_error(was, now):
        yield from _only_elsewhere(stage.effect, before, after, earthquakes)
        yield evidence(stage.effect, was, now, delta)
        return
    beside = ", ".join(one.effect for one in stages[:-1])
    alike = [one.effect for one in stage.step.alike]
    lacking = _is_missing(stage.effect, final.model, alike)
    yield _capital(f"beside {beside}, {lacking}" if beside else lacking)
    yield evidence(stage.effect, was, now, delta)
    if against := implausible(stage.effect, final, earthquakes.fitted):
        yield f"It is doubtful: {against}."
    if len(alike) > 1:
        yield f"Records that would distinguish them: {distinguishing_records(alike)}."
    if not helps(before, after, earthquakes):
        yield f"The error falls only for the fitted earthquakes: do not add {stage.effect} without another reason."


def remaining(left: Unexplained, added: int) -> str:
    """The error that the added effects leave, and whether it follows the motion of the layer."""
    effects = "this effect" if added == 1 else "these effects"
    size = f"With {effects}, the error is still {plain(left.noise_ratio, DIGITS)} times the noise"
    if left.share > STRUCTURED:
        return f"{size}, and {percent(left.share)} of its power follows the motion: the model is incomplete."
    return (
        f"{size}. Less than {percent(STRUCTURED)} of its power follows the motion, so these records do not show "
        "what else is missing."
    )


def resembling(steps: Sequence[Step]) -> Iterator[str]:
    """Sentences on the effects that are nearest to something unknown, with what each of them takes beside the others.

    Args:
        steps: of these effects, which earned no name.
    """
    for step in steps:
        yield f"It resembles {titled(step.chosen.effect)}, which is not the cause itself."
        if step.worth is None:
            continue
        fitted, held_out = _share(max(step.worth.fitted, 0.0)), step.worth.held_out
        if held_out is None:
            yield f"{_capital(step.chosen.effect)} takes {fitted} of the excess error where it was fitted."
        else:
            yield (
                f"{_capital(step.chosen.effect)} takes {fitted} of the excess error where it was fitted and "
                f"{_share(max(held_out, 0.0))} on held-out earthquakes."
            )


def unexplained_share(taken: Worth) -> str:
    """The share of the excess error that remains unexplained.

    Args:
        taken: the share that the added effects take.
    """
    fitted = _share(1 - taken.fitted)
    if taken.held_out is None:
        return f"Of the excess error (its power beyond the noise), {fitted} is unexplained where it was fitted."
    return (
        f"Of the excess error (its power beyond the noise), {fitted} is unexplained where it was fitted and "
        f"{_share(1 - taken.held_out)} on held-out earthquakes."
    )


def _share(share: float) -> str:
    """A share in percent; none is said to be nothing, since a share that is rounded to 0 may be a little."""
    return percent(share) if percent(share) != percent(0.0) else f"less than {percent(LEAST)}"


def distinguishing_records(effects: Sequence[str]) -> str:
    """Records that would separate effects which the present ones cannot distinguish."""
    return "; ".join(_hints(effects))


def _hints(effects: Sequence[str]) -> Iterator[str]:
    needs = {need for name in effects for need in EFFECTS[name].needs}
    yield from (hint for need, hint in HINTS.items() if need in needs)
    if any(EFFECTS[name].carried for name in effects):
        yield "a weak earthquake before a strong one, and another after it"
    yield "an earthquake of larger motion, and one of smaller"


def _only_elsewhere(effect: str, before: Version, after: Version, earthquakes: Earthquakes) -> Iterator[str]:
    """The worth on held-out earthquakes of an effect that does not lower the error where it was fitted."""
    held_out = earthquakes.groups.get(HELD_OUT, ())
    was, now = (version.error(held_out) if held_out else None for version in (before, after))
    if was is None or now is None or not lowers_error(was, now):
        yield f"{titled(effect)} was tried next and does not lower the error enough to be kept."
        return
    yield (
        f"{titled(effect)} lowers the error of the force on held-out earthquakes, from {percent(was.nrmse)} to "
        f"{percent(now.nrmse)}, but not where it was fitted: records of more earthquakes would decide."
    )


def _is_own(stages: Sequence[Stage], given: Isolator) -> bool:
    """True if the effect was judged beside exactly the effects that it is presented with."""
    there = {*given.effects, *(one.effect for one in stages[:-1])}
    return set(stages[-1].step.ranking.base.model.effects) == there


def action(model: Isolator, effect: str) -> str:
    """Explanation of a model's effect with its values, and with the form of its law if that is not the usual one."""
    about, values = EFFECTS[effect], model.effects[effect]
    unusual = (parameter((effect, name)) for name in unusual_forms(model, effect))
    forms = (
        f"The form of its law is not the usual one: {one.name} = {plain(shown(values[one.name], one.unit), 2)}"
        f"{f' {unit(one.unit)}'.rstrip()} ({one.meaning})."
        for one in unusual
    )
    return " ".join((explained(about, values), *forms))


def _is_missing(effect: str, model: Isolator, alike: list[str]) -> str:
    families = {EFFECTS[name].family for name in alike}
    if len(alike) < 2:
        return " ".join((f"{titled(effect)} is missing.", action(model, effect)))
    if len(families) == 1:
        either = " or ".join(map(titled, alike))
        return f"an effect of the family {families.pop()} is missing: {either}; the records cannot distinguish them."
    return f"one of these is missing, and the records cannot distinguish them: {'; '.join(map(titled, alike))}."


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
