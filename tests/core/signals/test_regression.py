"""Standard deviations that hold for autocorrelated residuals."""

import numpy as np
import pytest

from core.signals.regression import covariance_of_sum, regression


def test_standard_deviations_hold_when_residuals_are_autocorrelated() -> None:
    """Coverage of ± 1.96 standard deviations is never below 95 %, at the price of about three times their width."""
    rng = np.random.default_rng(2)
    time = np.arange(200) / 100
    regressors = np.column_stack([np.sin(np.pi * time), np.cos(np.pi * time), np.ones(200)])
    covered = plain = 0
    width, estimate = [], []
    for _ in range(1000):
        noise = np.zeros(300)
        for i, shock in enumerate(rng.standard_normal(299), start=1):
            noise[i] = 0.8 * noise[i - 1] + shock
        solution, covariance = regression(regressors, regressors @ [3.0, 1.0, 0.5] + noise[100:])
        covered += abs(solution[0] - 3.0) < 1.96 * np.sqrt(covariance[0, 0])
        width.append(np.sqrt(covariance[0, 0]))
        estimate.append(solution[0])
        residual = regressors @ (solution - [3.0, 1.0, 0.5]) - noise[100:]
        plain += abs(solution[0] - 3.0) < 1.96 * np.sqrt(
            residual.var() * np.linalg.inv(regressors.T @ regressors)[0, 0]
        )
    assert covered / 1000 >= 0.95
    assert np.mean(width) < 3.5 * np.std(estimate)
    assert plain / 1000 < 0.65


def test_the_variance_of_a_sum_of_correlated_terms() -> None:
    """Sums of two neighbours of white noise add 4 each to the variance of the sum; the kernel leaves 2/11 of that out.

    The mean of 400 estimates with a standard deviation of some 15 % is good to 1 %; five times that.
    """
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(400):
        shocks = rng.standard_normal(1001)
        terms = (shocks[1:] + shocks[:-1])[:, None]
        ratios.append(covariance_of_sum(terms, 10)[0, 0] / 1000)
    assert np.mean(ratios) == pytest.approx(4.0 - 2 / 11, abs=0.05 * 4)
