"""Searches: the slope is the derivative of what is lowered; shortcuts do not change where a search ends."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.fitting import search as searching
from core.fitting.data import FitData
from core.fitting.fit import fitted, reweighted_data
from core.fitting.projection import free_parameters, is_clamped, projected, values_of
from core.fitting.search import Outcome, Search, leads_to, start_search, step_search
from core.model.isolator import Isolator, Key

STEP = 1e-4
"""Step of a parameter's logarithm, to each side."""
DAMPING: Key = ("viscous", "c_b")
SPRING = {name: values for name, values in BOUC_WEN.effects.items() if name != "bouc_wen"}
RUBBER = {"hysteresis_spectrum": {"F_s": 1.5e6, "s": 0.5}}


@pytest.mark.parametrize("fed", [0.0, 3e7])
def test_the_slope_is_the_derivative_of_the_misfit(fed: float) -> None:
    """N s/m of damping are removed from the measured force: so much that c_b goes to zero, or none."""
    seen = [
        replace(one, layer=replace(one.layer, force=one.layer.force - fed * one.layer.velocity))
        for one in observations(BOUC_WEN, 0.02, 3, peaks=(0.05,), seconds=20.0)
    ]
    data = FitData.by_noise(seen)
    yields = {**BOUC_WEN.effects["bouc_wen"], "D_y": 6e-3}
    model = Isolator({**BOUC_WEN.effects, "bouc_wen": yields})
    search, values = free_parameters(model), values_of(model)
    start = start_search(data, model)
    assert is_clamped(DAMPING, start.point.values) == (fed > 0)

    def cost(key: Key, change: float) -> float:
        return projected(data, search, {**values, key: values[key] * np.exp(change)}).cost

    keys = [search.nonlinear[row] for row in start.slope.free]
    assert ("bouc_wen", "D_y") in keys
    for key, descent in zip(keys, start.slope.quadratic.descent, strict=True):
        derivative = (cost(key, STEP) - cost(key, -STEP)) / (2 * STEP)
        assert -descent == pytest.approx(derivative, rel=1e-3, abs=1e-4 * start.point.cost)


@pytest.fixture(scope="module")
def rubber() -> FitData:
    """Records of rubber, weighed by what one Dahl element leaves of them: much more than their noise."""
    by_noise = FitData.by_noise(observations(Isolator({**SPRING, **RUBBER}), 0.01, 3, (0.02, 0.08), 20.0))
    return reweighted_data(by_noise, fitted(by_noise, of_length(5e-3)))


def of_length(length: float) -> Isolator:
    """A model of rubber that is too simple, with a length of its hysteresis, m."""
    return Isolator({**SPRING, "second_hysteresis": {"D_2": length}})


def ended(data: FitData, now: Search) -> Search:
    while now.outcome is None:
        now = step_search(data, now)
    return now


@pytest.mark.parametrize("length", [1e-3, 3e-3, 2e-2])
def test_stretched_steps_end_in_the_same_minimum_earlier(
    rubber: FitData, length: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    stretched = ended(rubber, start_search(rubber, of_length(length)))
    monkeypatch.setattr(searching, "MOST_STRETCHED", 1.0)
    plain = ended(rubber, start_search(rubber, of_length(length)))
    assert stretched.steps < plain.steps
    assert stretched.cost < plain.cost + searching.SETTLED
    key: Key = ("second_hysteresis", "D_2")
    assert stretched.point.values[key] == pytest.approx(plain.point.values[key], rel=0.02)


@pytest.mark.parametrize("length", [1e-3, 2e-3, 3e-3, 2e-2])
def test_a_search_that_has_settled_has_nothing_left_to_gain(rubber: FitData, length: float) -> None:
    """It may end before the step that would show so, by the reduction that is predicted."""
    settled = ended(rubber, start_search(rubber, of_length(length)))
    further = step_search(rubber, replace(settled, outcome=None))
    assert further.gained < searching.SETTLED
    assert further.outcome is Outcome.SETTLED


@pytest.mark.parametrize("length", [1e-3, 1.5e-3, 2e-2])
def test_a_search_that_leads_to_a_known_minimum_would_end_there(rubber: FitData, length: float) -> None:
    known, now = ended(rubber, start_search(rubber, of_length(6e-3))), start_search(rubber, of_length(length))
    assert not leads_to(now, known), "it is far from it"
    while not leads_to(now, known):
        assert now.outcome is None
        now = step_search(rubber, now)
    assert now.outcome is None, "it ends before it would have settled"
    assert ended(rubber, now).cost == pytest.approx(known.cost, abs=2 * searching.SETTLED)


def test_a_search_that_is_lower_than_what_is_known_goes_on(rubber: FitData) -> None:
    known, now = ended(rubber, start_search(rubber, of_length(6e-3))), start_search(rubber, of_length(4.9e-3))
    higher = replace(known, point=replace(known.point, cost=now.cost + 1.0))
    assert leads_to(now, known)
    assert not leads_to(now, higher)


def test_a_search_in_another_form_of_a_law_does_not_lead_to_the_minimum_of_the_usual_one(rubber: FitData) -> None:
    known, now = ended(rubber, start_search(rubber, of_length(6e-3))), start_search(rubber, of_length(4.9e-3))
    other = replace(now, point=replace(now.point, values={**now.point.values, ("second_hysteresis", "unloading"): 0.5}))
    assert leads_to(now, known)
    assert not leads_to(other, known)
