"""Sentences about one effect: its explanation, the error without and with it, and that it is missing."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import UTC, timedelta
from types import MappingProxyType

import numpy as np

from core.comparison.misfit import Misfit
from core.diagnosis.effect_search import LOWERS, Step
from core.diagnosis.plausibility import implausible
from core.diagnosis.ranking import DECISIVE
from core.diagnosis.unexplained import STRUCTURED, Unexplained
from core.diagnosis.worth import Worth
from core.effect import explained
from core.effects import EFFECTS
from core.fitting.fit import Fit
from core.fitting.observation import USUAL_TEMPERATURE
from core.model.isolator import Isolator, parameter, unusual_forms
from core.rounding import plain
from core.units import percent, shown, unit
from core.workbench.candidates import Stage
from core.workbench.earthquakes import HELD_OUT, Earthquakes, Version, helps
from core.workbench.tables import Deviations

DIGITS = 3
"""Digits of an error in a sentence: its uncertainty is not known there."""
LEAST = 1e-3
"""Smallest share that is said as a number: one of its last digit."""
ALMOST_USUAL = 0.1
"""Share of the way to the nearest other form, below which a form is the usual one in words. A choice."""
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
    stages: Sequence[Stage],
    versions: Sequence[Version],
    given: Isolator,
    earthquakes: Earthquakes,
    final: Fit,
    std: Deviations,
) -> Iterator[str]:
    """Sentences on the last stage's effect: it is missing, or one that the records cannot distinguish from it, or it is
    not worth its place where the error does not fall.

    Args:
        stages: up to the effect in question.
        versions: without any of the effects, then with the first one, the first two, and so on up to it.
        given: the model that was diagnosed.
        earthquakes: those it was diagnosed by.
        final: fit of the model with all effects, whose values are stated.
        std: standard deviations of these values.
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
    lacking = _is_missing(stage.effect, final, alike, earthquakes)
    yield _capital(f"beside {beside}, {lacking}" if beside else lacking)
    if len(alike) < 2:
        yield from unseen(stage.effect, final.model, std)
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
        f"{size}. A regression on powers and delays of the motion, hysteresis, travel, vertical load, temperature and "
        f"the other direction predicts less than {percent(STRUCTURED)} of its power; an abrupt contact, for example, "
        "would not show in it."
    )


def resembling(steps: Sequence[Step]) -> Iterator[str]:
    """Sentences on the effects that are nearest to something unknown, with what each of them takes beside the others.

    Args:
        steps: of these effects, which earned no name.
    """
    for number, step in enumerate(steps):
        if number == 0:
            yield f"{titled(step.chosen.effect)} comes nearest and does not explain it."
        else:
            yield f"{titled(step.chosen.effect)} comes near too."
        if step.worth is None:
            continue
        fitted, held_out = _share(max(step.worth.fitted, 0.0)), step.worth.held_out
        if held_out is None:
            yield f"It takes {fitted} of the excess error where it was fitted."
        else:
            yield (
                f"It takes {fitted} of the excess error where it was fitted and "
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


def action(model: Isolator, effect: str, earthquakes: Earthquakes) -> str:
    """Explanation of a model's effect with its values, and with the form of its law if that is not the usual one.

    Args:
        model: with the effect.
        effect: its name.
        earthquakes: between which, or in one of which, an instant of the effect lies.
    """
    about, values = EFFECTS[effect], model.effects[effect]
    unusual = (parameter((effect, name)) for name in unusual_forms(model, effect) if _differs(model, effect, name))
    forms = (
        f"The form of its law is not the usual one: {one.name} = {plain(shown(values[one.name], one.unit), 2)}"
        f"{f' {unit(one.unit)}'.rstrip()} ({one.meaning})."
        for one in unusual
    )
    return " ".join((explained(about, values, lambda instant: _date(instant, earthquakes)), *forms))


def _differs(model: Isolator, effect: str, name: str) -> bool:
    """True if a form that was searched for is further from the usual one than rounding and noise make it."""
    usual = parameter((effect, name)).prior.median
    nearest = min(abs(other - usual) for other in EFFECTS[effect].forms[name])
    return abs(model.effects[effect][name] - usual) >= ALMOST_USUAL * nearest


def _date(instant: float, earthquakes: Earthquakes) -> str:
    """An instant, s after the earthquakes' reference: its date, and the earthquakes before and after it; that in which
    it lies, if it lies in one."""
    observed = sorted(earthquakes.observations, key=lambda one: one.start)
    at = earthquakes.reference + timedelta(seconds=instant)
    date = f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
    during = [one.name for one in observed if one.conditions.time[0] <= instant <= one.conditions.time[-1]]
    if during:
        return f"{date}, during the earthquake of {during[0]}"
    before = [one.name for one in observed if one.conditions.time[-1] < instant]
    after = [one.name for one in observed if one.conditions.time[0] > instant]
    if before and after:
        return f"{date}, between the earthquakes of {before[-1]} and {after[0]}"
    return date


def unseen(effect: str, model: Isolator, std: Deviations) -> Iterator[str]:
    """Amplitudes of an effect that has others too, which are smaller than their standard deviation."""
    linear, known = EFFECTS[effect].linear, std.get(effect, {})
    for one in (parameter((effect, name)) for name in linear if len(linear) > 1):
        if 0 < abs(model.effects[effect][one.name]) < known.get(one.name, 0.0):
            yield f"No {one.name} is seen in these records ({one.meaning}): its value is below its deviation."


def temperature_sentences(effects: Collection[str], earthquakes: Earthquakes) -> Iterator[str]:
    """That no temperature was recorded, if one of the effects is a change at an instant, as which another temperature
    may show.

    Args:
        effects: names of effects that are missing, or nearest to what is.
        earthquakes: those by which they were found.
    """
    is_step = any(one.is_instant for effect in effects for one in EFFECTS[effect].parameters)
    is_usual = all(bool(np.all(one.conditions.temperature == USUAL_TEMPERATURE)) for one in earthquakes.fitted)
    if is_step and is_usual:
        yield (
            "No temperature was recorded: what changes from one earthquake to another may be the effect of a "
            "temperature that changes. Records with the isolators' temperature would decide."
        )


def _is_missing(effect: str, final: Fit, alike: list[str], earthquakes: Earthquakes) -> str:
    families = {EFFECTS[name].family for name in alike}
    if len(alike) < 2:
        return " ".join((f"{titled(effect)} is missing.", action(final.model, effect, earthquakes)))
    if len(families) == 1:
        either = " or ".join(map(titled, alike))
        return f"an effect of the family {families.pop()} is missing: {either}; the records cannot distinguish them."
    return f"one of these is missing, and the records cannot distinguish them: {'; '.join(map(titled, alike))}."


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
