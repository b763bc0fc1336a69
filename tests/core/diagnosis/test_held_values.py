"""Parameters that a fit holds, at the values that records show: as good as by a fit from the true values, or left."""

import pytest
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.held_values import with_best_held
from core.diagnosis.ranking import HELD_WORTH
from core.fitting.data import FitData
from core.fitting.fit import fitted
from core.model.isolator import Isolator

NOISE = 0.005
HELD = [
    ("heating", {"loss": 6.0, "recovery": 30.0, "form": 1.3}, "form", 0.0),
    ("hysteresis_spectrum", {"F_s": 1e6, "s": 0.5, "D": 4e-3}, "D", 1e-3),
]
"""Effect, its true values, the parameter that a fit holds, and the usual value of it."""


@pytest.mark.parametrize(("effect", "values", "name", "usual"), HELD)
def test_a_held_value_is_found_from_the_usual_one(
    effect: str, values: dict[str, float], name: str, usual: float
) -> None:
    """20 %: what the noise leaves open."""
    truth = Isolator({**BOUC_WEN.effects, effect: values})
    data = FitData.by_noise(observations(truth, NOISE, 3))
    start = fitted(data, Isolator({**BOUC_WEN.effects, effect: {**values, name: usual}}))
    found = with_best_held(data, start.model, [effect])
    assert found is not None
    assert found.effects[effect][name] == pytest.approx(values[name], rel=0.2)
    best = fitted(data, truth).chi_square
    assert fitted(data, found).chi_square < 1.01 * best
    assert start.chi_square > (1 + HELD_WORTH) * best


@pytest.mark.parametrize(("effect", "values", "name", "usual"), HELD)
def test_a_held_value_stays_where_no_other_is_worth_it(
    effect: str, values: dict[str, float], name: str, usual: float
) -> None:
    truth = Isolator({**BOUC_WEN.effects, effect: {**values, name: usual}})
    data = FitData.by_noise(observations(truth, NOISE, 3))
    assert with_best_held(data, fitted(data, truth).model, [effect]) is None
