from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats

from core.identification.errors_in_variables import (
    RESIDUAL_TERMS,
    SMOOTH_TERMS,
    ModalTransfer,
    NoisySpectra,
    basis_functions,
    cost,
    cost_expansion,
    fit_transfer,
    least_squares_coefficients,
    transfer_function,
    transient,
)

W = 2 * np.pi * np.arange(0.2, 8.0, 0.02)


def transfer(rng: np.random.Generator, modes: int, floors: int, is_cut: bool) -> ModalTransfer:
    count = 2 * modes + SMOOTH_TERMS if is_cut else 0
    return ModalTransfer(
        angular_frequency=2 * np.pi * (1.3 * np.arange(1, modes + 1) + rng.uniform(-0.3, 0.3, modes)),
        damping_ratio=rng.uniform(0.01, 0.05, modes),
        forced=rng.uniform(-1, 1, (floors, modes + RESIDUAL_TERMS)),
        transient=rng.uniform(-1, 1, (floors, count)),
        delay=rng.uniform(-0.01, 0.01, floors),
        scale=float(W[-1]),
    )


def lines(rng: np.random.Generator, truth: ModalTransfer, noise: float) -> NoisySpectra:
    """Response of the transfer to a random base motion, with noise relative to each channel's root mean square."""
    base = complex_normal(rng, W.size)
    terms = basis_functions(truth, W)
    floors = transfer_function(truth, terms, W) * base + transient(truth, terms, W)
    spectra = np.vstack([base, floors])
    std = noise * np.sqrt(np.mean(np.abs(spectra) ** 2, axis=1))
    return NoisySpectra(W, spectra + std[:, None] * complex_normal(rng, *spectra.shape), std)


def complex_normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Circular complex normal numbers of variance 1."""
    return np.asarray((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2))


shapes = {"modes": st.integers(1, 4), "floors": st.integers(1, 4), "is_cut": st.booleans(), "seed": st.integers(0, 999)}


@settings(max_examples=20, deadline=None)
@given(**shapes)
def test_the_gradient_is_the_cost_s_derivative(modes: int, floors: int, is_cut: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = transfer(rng, modes, floors, is_cut)
    seen = lines(rng, transfer(rng, modes, floors, is_cut), 0.05)
    direction = rng.standard_normal(truth.parameters.size) * (0.01 + np.abs(truth.parameters))
    step = 1e-6 * direction
    slope = (cost(truth.plus(step), seen) - cost(truth.plus(-step), seen)) / 2e-6
    here = cost_expansion(truth, seen)
    # Central differences of a step of 1e-6 lose half the digits to rounding, the cost being far above its change.
    assert 2 * here.gradient @ direction == pytest.approx(slope, rel=1e-5, abs=1e-7 * here.cost)
    assert here.cost == pytest.approx(cost(truth, seen))


@settings(max_examples=10, deadline=None)
@given(**shapes)
def test_the_hessian_is_the_gradient_s_derivative_without_noise(
    modes: int, floors: int, is_cut: bool, seed: int
) -> None:
    """At the truth, where the terms that were left out are zero; with so little of it assumed that it adds nothing."""
    rng = np.random.default_rng(seed)
    truth = transfer(rng, modes, floors, is_cut)
    seen = replace(lines(rng, truth, 0.0), noise=1e-4 * rng.uniform(0.5, 2.0, floors + 1))
    direction = rng.standard_normal(truth.parameters.size) * (0.01 + np.abs(truth.parameters))
    step = 1e-6 * direction
    change = cost_expansion(truth.plus(step), seen).gradient - cost_expansion(truth.plus(-step), seen).gradient
    expected = cost_expansion(truth, seen).hessian @ direction
    scale = np.sqrt(np.diag(cost_expansion(truth, seen).hessian))
    # the rounding of the gradient's difference, against the largest of its entries
    assert change / 2e-6 / scale == pytest.approx(expected / scale, abs=1e-4 * np.abs(expected / scale).max())


@settings(max_examples=10, deadline=None)
@given(**shapes)
def test_without_noise_the_truth_is_detected(modes: int, floors: int, is_cut: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = transfer(rng, modes, floors, is_cut)
    seen = replace(lines(rng, truth, 0.0), noise=np.full(floors + 1, 1e-4))
    start = replace(
        truth,
        angular_frequency=truth.angular_frequency * rng.uniform(0.999, 1.001, modes),
        damping_ratio=truth.damping_ratio * rng.uniform(0.9, 1.1, modes),
    )
    start = least_squares_coefficients(
        replace(start, delay=np.zeros(floors)), W, seen.spectra[0], seen.spectra[1:], seen.noise
    )
    fit = fit_transfer(start, seen)
    assert fit.converged
    # A tenth of a standard deviation is where the steps end; the last one is not exact.
    std = np.sqrt(np.diag(fit.covariance))
    assert np.all(np.abs(fit.transfer.parameters - truth.parameters) <= 0.2 * std)


def test_covariance_and_misfit_are_those_of_repeated_records() -> None:
    """Normalised squared errors of all parameters, over 40 draws of noise: chi-square distributed."""
    rng = np.random.default_rng(7)
    truth = transfer(rng, modes=3, floors=2, is_cut=True)
    clean = lines(rng, truth, 0.0).spectra
    std = 0.1 * np.sqrt(np.mean(np.abs(clean) ** 2, axis=1))
    distances, misfits = [], []
    for _ in range(40):
        seen = NoisySpectra(W, clean + std[:, None] * complex_normal(rng, *clean.shape), std)
        fit = fit_transfer(truth, seen)
        error = fit.transfer.parameters - truth.parameters
        distances.append(error @ np.linalg.solve(fit.covariance, error))
        misfits.append(fit.misfit)
    count = 40 * truth.parameters.size
    # 99.9 % of a chi-square of that many degrees of freedom, as asymptotic theory gives it, and a tenth for its limits
    low, high = stats.chi2.ppf([0.0005, 0.9995], count) / count
    assert 0.9 * low < np.mean(distances) / truth.parameters.size < 1.1 * high
    freedom = 40 * fit.degrees_of_freedom
    assert np.mean(misfits) == pytest.approx(1.0, abs=3.3 * np.sqrt(2 / freedom))


def test_deviations_grow_with_a_misfit_that_noise_does_not_explain() -> None:
    """Half the noise assumed: four times the chi-square, and standard deviations that are right all the same."""
    rng = np.random.default_rng(8)
    truth = transfer(rng, modes=2, floors=2, is_cut=False)
    seen = lines(rng, truth, 0.02)
    right, sure = fit_transfer(truth, seen), fit_transfer(truth, replace(seen, noise=seen.noise / 2))
    assert sure.misfit == pytest.approx(4 * right.misfit, rel=1e-3)
    # 3 %: chi-square's own scatter, of which that below 1 does not count
    assert np.sqrt(np.diag(sure.covariance)) == pytest.approx(np.sqrt(np.diag(right.covariance)), rel=0.03)


def test_a_fit_claims_no_more_than_it_has_reached() -> None:
    """From distant start values, in a record without noise: the truth, no convergence, or a chi-square that shows the
    failure."""
    rng = np.random.default_rng(9)
    truth = transfer(rng, modes=2, floors=1, is_cut=False)
    seen = replace(lines(rng, truth, 0.0), noise=np.full(2, 1e-6))
    failed = 0
    for factor in (0.3, 0.5, 0.7, 1.6, 2.0, 3.0):
        far = replace(truth, angular_frequency=truth.angular_frequency * factor, damping_ratio=np.array([0.2, 1e-4]))
        fit = fit_transfer(far, seen)
        reached = np.sort(fit.transfer.angular_frequency) == pytest.approx(truth.angular_frequency, rel=1e-6)
        failed += not reached
        assert reached or not fit.converged or fit.misfit > 100
    assert failed


def test_lines_that_say_nothing_of_a_mode_end_the_search_without_a_result() -> None:
    """Floors at rest: no step can be computed, however much the diagonal is raised."""
    rng = np.random.default_rng(4)
    start = transfer(rng, 2, 2, is_cut=False)
    at_rest = replace(start, forced=np.zeros_like(start.forced))
    base = complex_normal(rng, W.size)
    seen = NoisySpectra(W, np.vstack([base, 0 * base, 0 * base]), np.ones(3))
    fit = fit_transfer(at_rest, seen)
    assert not fit.converged
    assert np.isnan(fit.covariance).all()
