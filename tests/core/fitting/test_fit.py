"""Parameters from records: exact without noise, within their standard deviations with it, and uncertain where the model
is incomplete or the records do not determine it."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.errors import RecordError
from core.fitting.data import FitData
from core.fitting.fit import fitted, weighted_fit
from core.fitting.search import Outcome
from core.model.isolator import Isolator

FAR = Isolator(
    {
        "elastic": {"k_b": 1e8},
        "viscous": {"c_b": 1e6},
        "bouc_wen": {"F_y": 5e6, "D_y": 1.5e-2, "A": 1.0, "beta": 0.2, "gamma": 0.5, "n": 1.0},
    }
)


def test_without_noise_the_values_are_exact() -> None:
    """1e-3: the prior of the nonlinear values is weighed against noise of 1e-4 of the force."""
    fit = fitted(FitData.by_noise(observations(BOUC_WEN, 1e-4, 1)), FAR)
    assert fit.outcome is Outcome.SETTLED
    for name, values in BOUC_WEN.effects.items():
        assert dict(fit.model.effects[name]) == pytest.approx(dict(values), rel=1e-3)


def test_standard_deviations_cover_the_truth() -> None:
    """Standard normal distances of 5 values in 12 draws: their mean square lies within 4 standard errors of 1."""
    squares = []
    for seed in range(12):
        fit = fitted(FitData.by_noise(observations(BOUC_WEN, 0.02, seed)), FAR)
        off = [(fit.model.effects[n][p] - BOUC_WEN.effects[n][p]) / std for (n, p), std in fit.std.items()]
        squares.append(np.mean(np.square(off)))
    assert np.mean(squares) == pytest.approx(1.0, abs=4 * np.std(squares, ddof=1) / np.sqrt(12))
    assert 0.3 < np.mean(squares) < 3.0


def test_a_linear_model_is_least_squares() -> None:
    """The same as numpy's for elastic and viscous forces, without bounds in the way."""
    seen = observations(BOUC_WEN, 0.02, 3)
    data = FitData.by_noise(seen)
    fit = fitted(data, Isolator({"elastic": {"k_b": 1.0}, "viscous": {"c_b": 1.0}}))
    rows = np.concatenate(
        [
            band.of(np.array([one.layer.displacement, one.layer.velocity]))
            for one, band in zip(seen, data.whitenings, strict=True)
        ],
        axis=1,
    )
    k_b, c_b = np.linalg.lstsq(rows.T, data.target, rcond=None)[0]
    assert fit.model.effects["elastic"]["k_b"] == pytest.approx(k_b, rel=1e-6)
    assert fit.model.effects["viscous"]["c_b"] == pytest.approx(c_b, rel=1e-6)


def test_a_value_stays_within_its_bounds_and_that_is_stated() -> None:
    """A force against the spring needs a negative stiffness, which rubber does not have."""
    seen = [replace(one, layer=replace(one.layer, force=-one.layer.force)) for one in observations(BOUC_WEN, 0.02, 4)]
    fit = fitted(FitData.by_noise(seen), Isolator({"elastic": {"k_b": 1e8}}))
    assert fit.model.effects["elastic"]["k_b"] == 0.0
    assert fit.outcome is Outcome.AT_BOUND


def test_what_no_record_excites_is_reported_as_undetermined() -> None:
    """The wall stands beyond the largest displacement."""
    wall = {"gap": 0.3, "gap_back": 0.3, "wall": 1e8, "wall_back": 1e8}
    fit = fitted(FitData.by_noise(observations(BOUC_WEN, 0.02, 5)), Isolator({**BOUC_WEN.effects, "moat": wall}))
    assert fit.outcome is Outcome.UNDETERMINED
    assert {("moat", "wall"), ("moat", "gap")} <= set(fit.undetermined)


LINEAR = Isolator({"elastic": {"k_b": 4e8}, "viscous": {"c_b": 8e6}})


def test_a_right_model_is_fitted_as_by_the_noise() -> None:
    """5 %: the noise's own power in 30 s of record, by which it is weighed where that is above what was expected."""
    seen = observations(BOUC_WEN, 0.02, 5)
    plain, result = fitted(FitData.by_noise(seen), BOUC_WEN), weighted_fit(seen, BOUC_WEN)
    assert result.inflation == pytest.approx(1.0, abs=0.2)
    for key, std in plain.std.items():
        assert result.fit.std[key] == pytest.approx(std, rel=0.05)


def test_a_model_that_lacks_hysteresis_knows_its_stiffness_worse_than_the_noise_would_have_it() -> None:
    """Fitted to other earthquakes it would be another one, by far more than the noise's deviation."""
    seen = observations(BOUC_WEN, 0.01, 6)
    plain, result = fitted(FitData.by_noise(seen), LINEAR), weighted_fit(seen, LINEAR)
    honest = result.fit.std["elastic", "k_b"] * result.inflation**0.5
    assert honest > 3 * plain.std["elastic", "k_b"]


def test_no_record_is_weighed_to_nothing() -> None:
    seen = observations(BOUC_WEN, 0.01, 6)
    data = weighted_fit(seen, LINEAR).data
    for span in data.spans:
        assert data.target[span] @ data.target[span] > 0


def test_nothing_to_fit_to_is_an_error() -> None:
    with pytest.raises(RecordError, match="no earthquake is left to fit"):
        weighted_fit((), LINEAR)


@pytest.mark.parametrize("days", [20.0, 75.0])
def test_the_date_of_a_gradual_change_is_found_from_afar(days: float) -> None:
    """Earthquakes on the days 0, 30, 60 and 90, a change by tanh about day 40: half a day, as the noise leaves it."""
    day = 86400.0
    step = {"change": -0.4, "date": 40 * day, "width": 8 * day}
    seen = observations(Isolator({**BOUC_WEN.effects, "stiffness_step": step}), 0.005, 3, (0.03, 0.05, 0.04, 0.06))
    begun = Isolator({**BOUC_WEN.effects, "stiffness_step": {**step, "change": -0.1, "date": days * day}})
    found = fitted(FitData.by_noise(seen), begun).model.effects["stiffness_step"]
    assert found["date"] == pytest.approx(step["date"], abs=0.5 * day)
    assert found["change"] == pytest.approx(step["change"], abs=0.01)
