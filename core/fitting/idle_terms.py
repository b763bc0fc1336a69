"""Terms of effects that no record makes act: they stay 0, since beyond the records their force could be anything.

A term is one of several amplitudes of an effect, such as the fifth power of hardening.
"""

from collections.abc import Collection, Sequence
from math import sqrt

from core.effects import EFFECTS
from core.fitting.fit import WeightedFit, weighted_fit
from core.fitting.observation import Observation
from core.model.isolator import Isolator, Key

CERTAIN = 3.0
"""Standard deviations by which a term must differ from 0. A choice."""


def terms_at_zero(model: Isolator) -> frozenset[Key]:
    """Terms that are 0 in a model beside another amplitude of the same effect that is not."""
    return frozenset(
        (effect, name)
        for effect, values in model.effects.items()
        for name in EFFECTS[effect].linear
        if values[name] == 0 and any(values[other] != 0 for other in EFFECTS[effect].linear)
    )


def acting_fit(
    observations: Sequence[Observation],
    model: Isolator,
    zero: frozenset[Key] = frozenset(),
    among: Collection[Key] | None = None,
) -> tuple[WeightedFit, frozenset[Key]]:
    """Weighted fit, and the terms that stay 0 in it: those given, and those that no record makes act.

    Args:
        observations: the records.
        model: effects, and values to start from.
        zero: terms that are and stay 0.
        among: terms that may stay 0 besides; None for all.

    Raises:
        RecordError: there are no observations.
        ModelError: the model's force diverged.
    """
    while True:
        weighted = weighted_fit(observations, model, zero)
        fit, size = weighted.fit, sqrt(weighted.inflation)
        terms = [key for key in fit.free if _is_term(key, zero) and (among is None or key in among)]
        weak = {key: abs(_value(fit.model, key)) / (size * fit.std[key]) if fit.std[key] > 0 else 0.0 for key in terms}
        weak |= {key: 0.0 for key in terms if key in fit.undetermined}
        least = min(weak, key=lambda key: weak[key], default=None)
        if least is None or weak[least] >= CERTAIN:
            return weighted, zero
        zero |= {least}
        model = _at_zero(fit.model, least)


def _is_term(key: Key, zero: Collection[Key]) -> bool:
    """True if a parameter is an amplitude of an effect that has others besides."""
    linear = EFFECTS[key[0]].linear
    return key[1] in linear and len({name for name in linear if (key[0], name) not in zero}) > 1


def _value(model: Isolator, key: Key) -> float:
    return float(model.effects[key[0]][key[1]])


def _at_zero(model: Isolator, key: Key) -> Isolator:
    effect, name = key
    return Isolator({**model.effects, effect: {**model.effects[effect], name: 0.0}})
