"""Searches that are left off: the best one is the same as if all had been made, and what is left off is far from it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hidden.trial import trial
from observed_trials import observed_along_x
from synthetic_observations import BOUC_WEN, observations

from core.arrays import Vector
from core.diagnosis.candidate_search import NEAR, score_tests, search_in_parallel, starts
from core.fitting.data import FitData
from core.fitting.fit import fitted, residual_at, reweighted_data, signatures
from core.fitting.observation import Observation
from core.fitting.search import Outcome
from core.model.first_model import first_model
from core.model.isolator import Isolator

EFFECTS = ("hardening", "friction", "maxwell", "second_hysteresis", "relief", "mullins")


@pytest.mark.accuracy
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("hardening", {"k3": 2e10, "k5": 0.0}),
        ("friction", {"sliding": 1.2e6, "share": 0.5, "a": 30.0, "slip": 5e-4}),
    ],
)
def test_the_best_is_as_good_as_by_full_searches_and_what_is_left_off_is_far_from_it(
    name: str, values: dict[str, float]
) -> None:
    data = FitData.by_noise(observations(Isolator({**BOUC_WEN.effects, name: values}), 0.02, 5))
    base = fitted(data, BOUC_WEN)
    places = {searches[0].effect: [one.model for one in searches] for searches in score_tests(data, base, EFFECTS)}
    searches = search_in_parallel(data, places)
    whole = {
        effect: min((fitted(data, model) for model in models), key=lambda fit: fit.chi_square)
        for effect, models in places.items()
    }
    best = min(whole, key=lambda effect: whole[effect].chi_square)
    assert searches[best].chi_square == pytest.approx(whole[best].chi_square, rel=1e-3)
    left_off = [effect for effect, fit in searches.items() if fit.outcome is Outcome.STOPPED]
    assert left_off
    assert all(whole[effect].chi_square > NEAR * whole[best].chi_square for effect in left_off)


def test_a_search_that_cannot_come_below_what_is_asked_for_is_stopped() -> None:
    """Asked for half of what the true law leaves: what is found is farther from its minimum than without the limit."""
    values = {"sliding": 1.2e6, "share": 0.5, "a": 30.0, "slip": 5e-4}
    truth = Isolator({**BOUC_WEN.effects, "friction": values})
    data = FitData.by_noise(observations(truth, 0.02, 5))
    base = fitted(data, BOUC_WEN)
    places = {
        one.effect: [one.model, *(more.model for more in others)] for one, *others in score_tests(data, base, EFFECTS)
    }
    best = fitted(data, truth).chi_square
    whole, limited = (search_in_parallel(data, places, below=below) for below in (np.inf, 0.5 * best))
    assert whole["friction"].chi_square == pytest.approx(best, rel=0.01)
    assert whole["friction"].outcome is Outcome.SETTLED
    assert limited["friction"].outcome is Outcome.STOPPED
    assert limited["friction"].chi_square > whole["friction"].chi_square


@pytest.mark.accuracy
def test_the_slip_is_found_where_the_misfit_has_several_minima() -> None:
    """As a building moves, a slip is over within a few samples. 3 %: the noise; the minimum next to it is 8 % off."""
    made = trial("breakaway", 10)
    data = FitData.by_noise(observed_along_x(made))
    base = fitted(data, first_model(made.description).isolator)
    ((first, *others),) = score_tests(data, base, ["breakaway"])
    found = search_in_parallel(data, {"breakaway": [first.model, *(one.model for one in others)]}, ["breakaway"])
    ((_, hidden),) = made.hidden
    assert found["breakaway"].model.effects["breakaway"]["slip"] == pytest.approx(hidden["length"], rel=0.03)


def test_the_score_is_what_a_small_amount_of_the_effect_changes() -> None:
    """For an effect with an amplitude the force of one unit; for one without, the difference of two whole forces.

    1e-8: the same numbers, added in another order.
    """
    data = FitData.by_noise(observations(BOUC_WEN, 0.02, 5, peaks=(0.01, 0.05), seconds=20.0))
    base = fitted(data, BOUC_WEN)
    for effect, per in (("mullins", 1e8), ("pinching", 1.0), ("vertical_load", 1.0)):
        values = list(starts(effect, data.observations))[:3]
        given = [{**one, "k_M": per} if effect == "mullins" else one for one in values]
        models = [Isolator({**base.model.effects, effect: one}) for one in given]
        for model, (row,) in zip(models, signatures(data, base, models), strict=True):
            whole = residual_at(data, base.model) - residual_at(data, model)
            assert per * row == pytest.approx(whole, abs=1e-8 * np.abs(whole).max())


def test_a_date_is_looked_for_between_every_two_earthquakes_and_within_each() -> None:
    seen = observations(BOUC_WEN, 0.01, 3)
    dates = {values["date"] for values in starts("stiffness_step", seen)}
    times = [one.conditions.time for one in seen]
    for before, after in pairwise(times):
        assert any(before[-1] < date < after[0] for date in dates)
    for time in times:
        assert any(time[0] < date < time[-1] for date in dates)


def test_a_wall_that_only_the_strongest_motion_reaches_is_found() -> None:
    """At 170 and 180 mm, of 186 and 300 mm, with a force of the power 1.5 and damping: the search had begun at 100 and
    270 mm, and stayed at 91 mm on one side."""

    def contact(one: Observation) -> Vector:
        u, v = one.layer.displacement, one.layer.velocity
        beyond = np.maximum(np.where(u > 0, u - 0.17, -u - 0.18), 0.0)
        return np.asarray(np.sign(u) * np.maximum(2.3e9 * beyond**1.5 * (1 + 0.6 * v * np.sign(u)), 0.0))

    seen = [
        replace(one, layer=replace(one.layer, force=one.layer.force + contact(one)))
        for one in observations(BOUC_WEN, 0.01, 7, (0.12, 0.3, 0.15))
    ]
    by_noise = FitData.by_noise(seen)
    data = reweighted_data(by_noise, fitted(by_noise, BOUC_WEN))
    base = fitted(data, BOUC_WEN)
    (places,) = score_tests(data, base, ["moat"])
    found = search_in_parallel(data, {"moat": [one.model for one in places]})["moat"]
    values = found.model.effects["moat"]
    assert (values["gap"], values["gap_back"]) == pytest.approx((0.17, 0.18), rel=0.12)
