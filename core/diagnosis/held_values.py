"""Parameters that a fit keeps at a usual value, at the values that records show: lengths, and the form of a law.

A fit holds such a parameter since few records determine it. Where the usual value is far from the true one, the effect
leaves an error that a second effect takes away: the parameter is therefore searched before another effect is.
"""

from collections.abc import Collection

import numpy as np

from core.diagnosis.ranking import FORM_LEAVES, Ranking, in_best_form, is_worth_holding
from core.effect import LogNormal
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, fitted, tangents
from core.fitting.projection import derivatives, diverges, free_parameters, values_of
from core.fitting.search import LONGEST_STEP
from core.model.isolator import Isolator, Key, parameter

OWN = 1e-3
"""Share of a value's effect on the force that must be its own. A choice."""
FIRST = 0.35
"""Smallest first change, of the logarithm or in standard deviations of the prior: far from the best value the first
order tells little. A choice."""
SETTLED = 0.01
"""Change of the same kind below which the search ends. A choice."""
MOST_STEPS = 8
"""Steps after which it ends. A choice."""
MOST_HALVINGS = 2
"""Times that a step which raises the misfit is halved. A choice."""


def with_best_held(ranking: Ranking, effects: Collection[str]) -> Isolator | None:
    """A ranking's model with held parameters of these effects at better values; None if the records show none.

    Args:
        ranking: of the candidates beside a model.
        effects: of the model.
    """
    data, fit = ranking.data, ranking.base
    for name in effects:
        other = in_best_form(data, fit, name, ranking.inflation)
        fit = other if ranking.noise_ratio(other) <= FORM_LEAVES else fit
    for effect, name in _searched(effects):
        better = _at_best(data, fit, (effect, name))
        is_credible = name not in EFFECTS[effect].forms or ranking.noise_ratio(better) <= FORM_LEAVES
        if is_credible and is_worth_holding(data, fit, better, ranking.inflation):
            fit = better
    return None if fit is ranking.base else fit.model


def _searched(effects: Collection[str]) -> list[Key]:
    """Held lengths, and forms that are a matter of degree."""
    return [
        (name, one.name)
        for name in effects
        for one in EFFECTS[name].parameters
        if one.name in EFFECTS[name].forms
        or (one.name in EFFECTS[name].held and one.unit == "m" and isinstance(one.prior, LogNormal))
    ]


def _at_best(data: FitData, fit: Fit, key: Key) -> Fit:
    """The fit at the value of the smallest misfit, all other values adapted to it."""
    step = _step(data, fit, key)
    if step == 0:
        return fit
    first = float(np.copysign(max(abs(step), FIRST), step))
    new = _lower(data, fit, key, first) or _lower(data, fit, key, -first)
    for _ in range(MOST_STEPS):
        if new is None:
            break
        moved, fit = abs(_distance(fit, new, key)), new
        if moved < SETTLED:
            break
        new = _lower(data, fit, key, _step(data, fit, key))
    return fit


def _distance(fit: Fit, new: Fit, key: Key) -> float:
    before, after = (one.model.effects[key[0]][key[1]] for one in (fit, new))
    prior = parameter(key).prior
    return float(np.log(after / before)) if isinstance(prior, LogNormal) else (after - before) / prior.spread


def _lower(data: FitData, fit: Fit, key: Key, step: float) -> Fit | None:
    """The fit after a step, halved until the misfit falls; None if it never does."""
    step = float(np.clip(step, -LONGEST_STEP, LONGEST_STEP))
    for _ in range(MOST_HALVINGS + 1):
        new = fitted(data, _moved(fit.model, key, step))
        if new.chi_square < fit.chi_square:
            return new
        step /= 2
    return None


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
