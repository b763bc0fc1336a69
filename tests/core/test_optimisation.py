import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.optimisation import damped_step, scaled_inverse

UNITS = st.floats(-8, 8).map(lambda power: 10.0**power)


def quadratic(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(3, 3) positive definite matrix, well conditioned, and (3,) descent."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((20, 3))
    return rows.T @ rows, rng.standard_normal(3)


@given(st.integers(0, 1000), st.tuples(UNITS, UNITS, UNITS), st.floats(0, 10))
def test_the_step_does_not_depend_on_the_parameters_units(
    seed: int, units: tuple[float, float, float], damping: float
) -> None:
    normal, descent = quadratic(seed)
    scale = np.array(units)
    step = damped_step(normal, descent, damping)
    other = damped_step(normal * np.outer(scale, scale), descent * scale, damping)
    assert step is not None
    assert other is not None
    assert other * scale == pytest.approx(step, rel=1e-9)


def test_without_damping_the_step_reaches_the_minimum_and_damping_shortens_it() -> None:
    normal, descent = quadratic(1)
    whole, short = damped_step(normal, descent, 0.0), damped_step(normal, descent, 1.0)
    assert whole is not None
    assert short is not None
    assert normal @ whole == pytest.approx(descent)
    assert np.linalg.norm(short) < np.linalg.norm(whole)
    assert descent @ short > 0


def test_a_matrix_that_is_not_positive_definite_is_damped_until_the_step_goes_down() -> None:
    step = damped_step(np.array([[1.0, 2.0], [2.0, 1.0]]), np.array([1.0, -1.0]), 1e-3)
    assert step is not None
    assert step @ [1.0, -1.0] > 0


def test_no_step_without_curvature_or_with_infinite_values() -> None:
    assert damped_step(np.diag([1.0, 0.0]), np.ones(2), 1.0) is None
    assert damped_step(np.diag([1.0, np.inf]), np.ones(2), 1.0) is None


@given(st.integers(0, 1000), st.tuples(UNITS, UNITS, UNITS))
def test_the_scaled_inverse_is_the_inverse_in_any_units(seed: int, units: tuple[float, float, float]) -> None:
    normal, _ = quadratic(seed)
    scale = np.array(units)
    found = scaled_inverse(normal * np.outer(scale, scale)) * np.outer(scale, scale)
    assert found == pytest.approx(np.linalg.inv(normal), rel=1e-6, abs=1e-9)


def test_an_undetermined_parameter_does_not_spoil_the_others() -> None:
    assert scaled_inverse(np.diag([4.0, 0.0]))[0, 0] == pytest.approx(0.25)
