import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.comparison.misfit import fitting_rate, misfit, pooled

TRUTH = np.sin(np.linspace(0, 20, 500)) + 0.3
seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds)
def test_fitting_rate_is_the_papers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    measured, model = rng.standard_normal(50) + 3, rng.standard_normal(50)
    assert misfit(measured, model, np.ones(50)).fitting_rate == pytest.approx(fitting_rate(measured, model))


@given(seed=seeds)
def test_records_together_are_one_long_record(seed: int) -> None:
    """The mean is each record's own, so that only the fitting rate of records without a mean is that of one."""
    rng = np.random.default_rng(seed)
    measured, model, std = rng.standard_normal((3, 2, 40))
    measured -= measured.mean(axis=1, keepdims=True)
    parts = pooled([misfit(*part) for part in zip(measured, model, abs(std), strict=True)])
    whole = misfit(measured.ravel(), model.ravel(), abs(std).ravel())
    for measure in ("rms", "nrmse", "fitting_rate"):
        assert getattr(parts, measure) == pytest.approx(getattr(whole, measure))


@given(seed=seeds)
def test_each_record_counts_by_its_own_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    measured, model = rng.standard_normal((2, 2, 40))
    noise = np.array([0.1, 10.0])
    parts = [misfit(m, n, np.full(40, std)) for m, n, std in zip(measured, model, noise, strict=True)]
    whole = misfit((measured / noise[:, None]).ravel(), (model / noise[:, None]).ravel(), np.ones(80))
    result = pooled(parts)
    assert result.noise_ratio == pytest.approx(whole.noise_ratio)
    assert result.rms == pytest.approx(result.noise_ratio * result.floor)


def test_a_right_model_has_an_error_of_one_floor() -> None:
    """To 3 %: 10 standard errors of a root mean square over 10⁵ samples."""
    noise = 2.0 * np.random.default_rng(1).standard_normal(100_000)
    error = misfit(100.0 + noise, np.full(noise.size, 100.0), np.full(noise.size, 2.0))
    assert error.noise_ratio == pytest.approx(1.0, rel=0.03)
    assert error.floor == pytest.approx(2.0)


def test_excess_is_what_noise_does_not_explain() -> None:
    error = misfit(np.full(10, 5.0), np.zeros(10), np.full(10, 3.0))
    assert error.excess == pytest.approx(4.0)
    assert error.nrmse == pytest.approx(1.0)


def test_a_measurement_at_rest_has_no_rate() -> None:
    error = misfit(np.zeros(10), np.ones(10), np.zeros(10))
    assert error.nrmse == error.noise_ratio == np.inf
    assert error.fitting_rate == -np.inf


def test_exact_is_a_hundred_and_the_mean_is_zero() -> None:
    assert fitting_rate(TRUTH, TRUTH) == 100.0
    assert fitting_rate(TRUTH, np.full_like(TRUTH, TRUTH.mean())) == pytest.approx(0.0, abs=1e-12)  # rounding


@given(st.floats(0.0, 2.0))
def test_a_scaled_truth_of_zero_mean_is_off_by_the_scale(scale: float) -> None:
    """Figure 15: a force that is a tenth too small fits to 90 %."""
    centred = TRUTH - TRUTH.mean()
    assert fitting_rate(centred, scale * centred) == pytest.approx(100 * (1 - abs(1 - scale)), abs=1e-9)  # rounding
