"""Lengths of effects that a fit keeps at a usual value, at the values that records show.

A fit holds such a length since few records determine it. Where the usual value is far from the true one, the effect
leaves an error that a second effect takes away: the length is therefore searched before another effect is.
"""

from collections.abc import Collection

import numpy as np

from core.diagnosis.ranking import DECISIVE, Ranking
from core.effect import LogNormal
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, fitted, tangents
from core.fitting.projection import derivatives, diverges, free_parameters, values_of
from core.fitting.search import LONGEST_STEP
from core.model.isolator import Isolator, Key, parameter

WORTH = 0.03
"""Smallest share of the residual's power that another length must take to be kept. A choice."""
OWN = 1e-3
"""Share of a length's effect on the force that must be its own. A choice."""
FIRST = 0.35
"""Smallest first change of a length's logarithm: far from the best length the first order tells little. A choice."""
SETTLED = 0.01
"""Relative change of a length below which its search ends. A choice."""
MOST_STEPS = 8
"""Steps after which it ends. A choice."""
MOST_HALVINGS = 2
"""Times that a step which raises the misfit is halved. A choice."""


def with_best_lengths(ranking: Ranking, effects: Collection[str]) -> Isolator | None:
    """A ranking's model with the held lengths of these effects at better values; None if the records show none.

    Args:
        ranking: of the candidates beside a model.
        effects: of the model.
    """
    data, fit = ranking.data, ranking.base
    evident = ranking.inflation * (DECISIVE + float(np.log(ranking.independent)))
    for key in _held_lengths(effects):
        better = _at_best(data, fit, key)
        if better.chi_square < fit.chi_square - max(evident, WORTH * fit.chi_square):
            fit = better
    return None if fit is ranking.base else fit.model


def _held_lengths(effects: Collection[str]) -> list[Key]:
    return [
        (name, one.name)
        for name in effects
        for one in EFFECTS[name].parameters
        if one.name in EFFECTS[name].held and one.unit == "m" and isinstance(one.prior, LogNormal)
    ]


def _at_best(data: FitData, fit: Fit, key: Key) -> Fit:
    """The fit at the length of the smallest misfit, all other values adapted to it."""
    step = _step(data, fit, key)
    if step == 0:
        return fit
    first = float(np.copysign(max(abs(step), FIRST), step))
    new = _lower(data, fit, key, first) or _lower(data, fit, key, -first)
    for _ in range(MOST_STEPS):
        if new is None:
            break
        moved, fit = abs(np.log(_length(new, key) / _length(fit, key))), new
        if moved < SETTLED:
            break
        new = _lower(data, fit, key, _step(data, fit, key))
    return fit


def _length(fit: Fit, key: Key) -> float:
    return fit.model.effects[key[0]][key[1]]


def _lower(data: FitData, fit: Fit, key: Key, step: float) -> Fit | None:
    """The fit after a step of the length's logarithm, halved until the misfit falls; None if it never does."""
    step = float(np.clip(step, -LONGEST_STEP, LONGEST_STEP))
    for _ in range(MOST_HALVINGS + 1):
        new = fitted(data, _moved(fit.model, key, step))
        if new.chi_square < fit.chi_square:
            return new
        step /= 2
    return None


def _moved(model: Isolator, key: Key, step: float) -> Isolator:
    effect, name = key
    values = model.effects[effect]
    value = float(np.clip(values[name] * np.exp(step), *parameter(key).bounds))
    return Isolator({**model.effects, effect: {**values, name: value}})


def _step(data: FitData, fit: Fit, key: Key) -> float:
    """Change of the length's logarithm that lowers the misfit most, to first order; 0 if other values imitate it."""
    values = values_of(fit.model)
    change = values[key] * derivatives(data, free_parameters(fit.model), values, [key])[0]
    if diverges(change[None]):
        return 0.0
    basis = np.linalg.qr(tangents(data, fit).T).Q
    own = change - basis @ (change @ basis)
    size = float(np.linalg.norm(own))
    return float(own @ fit.residual) / size**2 if size > OWN * float(np.linalg.norm(change)) else 0.0
