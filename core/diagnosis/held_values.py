"""Parameters that a fit keeps at a usual value, at the values that records show: lengths, and the form of a law.

A fit holds such a parameter since few records determine it. Where the usual value is far from the true one, the effect
leaves an error that a second effect takes away: the parameter is therefore searched before another effect is.
"""

from collections.abc import Collection

import numpy as np

from core.diagnosis.candidate_search import lower_fit
from core.diagnosis.ranking import FORM_LEAVES, in_best_form, noise_floor, noise_ratio, worth_holding
from core.effect import LogNormal
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, reweighted_fit, tangents
from core.fitting.projection import derivatives, diverges, free_parameters, values_of
from core.fitting.search import LONGEST_STEP
from core.model.isolator import Isolator, Key, parameter

OWN = 1e-3
"""Share of a value's effect on the force that must be its own. A choice."""
FIRST = 0.35
"""Smallest first change, of the logarithm or in standard deviations of the prior: far from the best value the first
order tells little. A choice."""


def with_best_held(by_noise: FitData, model: Isolator, effects: Collection[str]) -> Isolator | None:
    """A model with held parameters of these effects at better values; None if the records show none.

    Args:
        by_noise: the records, weighed by their noise.
        model: with the effects, at fitted values.
        effects: of the model.
    """
    floor = noise_floor(by_noise)
    first = now = reweighted_fit(by_noise, model)
    for effect in effects:
        other = in_best_form(now.data, now.fit, effect, now.inflation, whole=True)
        if other is not now.fit and noise_ratio(now.data, other, floor) <= FORM_LEAVES:
            now = reweighted_fit(by_noise, other.model)
    for effect, name in _searched(effects):
        better = _at_best(now.data, now.fit, (effect, name), worth_holding(now.data, now.fit, now.inflation))
        is_form = name in EFFECTS[effect].forms
        if better is not None and (not is_form or noise_ratio(now.data, better, floor) <= FORM_LEAVES):
            now = reweighted_fit(by_noise, better.model)
    return None if now is first else now.fit.model


def _searched(effects: Collection[str]) -> list[Key]:
    """Held lengths, and forms that are a matter of degree."""
    return [
        (name, one.name)
        for name in effects
        for one in EFFECTS[name].parameters
        if one.name in EFFECTS[name].forms
        or (one.name in EFFECTS[name].held and one.unit == "m" and isinstance(one.prior, LogNormal))
    ]


def _at_best(data: FitData, fit: Fit, key: Key, worth: float) -> Fit | None:
    """The fit with a held parameter searched for too, from either side of its value; None if that is not worth it."""
    step = _step(data, fit, key)
    if step == 0:
        return None
    first = float(np.copysign(np.clip(abs(step), FIRST, LONGEST_STEP), step))
    return lower_fit(data, fit, [_moved(fit.model, key, one) for one in (first, -first)], worth, also=[key])


def _moved(model: Isolator, key: Key, step: float) -> Isolator:
    effect, name = key
    values, about = model.effects[effect], parameter(key)
    is_log = isinstance(about.prior, LogNormal)
    moved = values[name] * np.exp(step) if is_log else values[name] + step * about.prior.spread
    return Isolator({**model.effects, effect: {**values, name: float(np.clip(moved, *about.bounds))}})


def _step(data: FitData, fit: Fit, key: Key) -> float:
    """Change that lowers the misfit most, to first order; 0 if other values imitate it."""
    values, prior = values_of(fit.model), parameter(key).prior
    scale = values[key] if isinstance(prior, LogNormal) else prior.spread
    change = scale * derivatives(data, free_parameters(fit.model), values, [key])[0]
    if diverges(change[None]):
        return 0.0
    basis = np.linalg.qr(tangents(data, fit).T).Q
    own = change - basis @ (change @ basis)
    size = float(np.linalg.norm(own))
    return float(own @ fit.residual) / size**2 if size > OWN * float(np.linalg.norm(change)) else 0.0
