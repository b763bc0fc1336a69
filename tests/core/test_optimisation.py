"""Damped steps in any units, descent to a minimum, and bounded amplitudes that satisfy Karush, Kuhn and Tucker."""

from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.arrays import Matrix, Vector
from core.optimisation import (
    Damping,
    FactorDamping,
    GainRatioDamping,
    Quadratic,
    Step,
    bounded_least_squares,
    damped_step,
    lower_point,
    minimised,
    scaled_inverse,
)

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


@dataclass(frozen=True)
class Valley:
    """A point of Rosenbrock's (1960) function as a sum of squares, half of it: the minimum is 0 at (1, 1)."""

    x: float
    y: float

    @property
    def residual(self) -> Vector:
        return np.array([1 - self.x, 10 * (self.y - self.x**2)])

    @property
    def cost(self) -> float:
        return 0.5 * float(self.residual @ self.residual)

    @property
    def quadratic(self) -> Quadratic:
        slope = np.array([[-1.0, 0.0], [-20 * self.x, 10.0]])
        return Quadratic(slope.T @ slope, -slope.T @ self.residual)

    def moved(self, step: Vector) -> "Valley":
        return Valley(self.x + float(step[0]), self.y + float(step[1]))


def valley_step(most_trials: int, here: Valley, damping: Damping) -> Step[Valley] | None:
    return lower_point(here, here.quadratic, here.moved, damping, most_trials)


@pytest.mark.parametrize(
    ("damping", "most_trials"), [(FactorDamping(1e-3, 8.0, 8.0, 1e-8), 8), (GainRatioDamping(1e-3), 1)]
)
def test_the_minimum_of_a_curved_valley_is_reached(damping: Damping, most_trials: int) -> None:
    costs = []

    def has_settled(before: Valley, latest: Step[Valley]) -> bool:
        costs.append(before.cost)
        return latest.point.cost < 1e-20

    end, settled = minimised(Valley(-1.2, 1.0), partial(valley_step, most_trials), has_settled, damping, 100)
    assert settled
    assert (end.x, end.y) == pytest.approx((1.0, 1.0), abs=1e-8)
    assert costs == sorted(costs, reverse=True)
    _, settled = minimised(Valley(-1.2, 1.0), partial(valley_step, most_trials), lambda *_: False, damping, 3)
    assert not settled


@pytest.mark.parametrize("damping", [FactorDamping(1e-3, 8.0, 8.0, 1e-8), GainRatioDamping(1e-3)])
def test_where_no_trial_lowers_the_cost_the_point_stays_and_the_damping_grows(damping: Damping) -> None:
    start = Valley(-1.2, 1.0)
    step = lower_point(start, start.quadratic, lambda _: Valley(9.0, 9.0), damping, 3)
    assert step is not None
    assert (step.point, step.gained) == (start, 0.0)
    assert step.damping.value == pytest.approx(1e-3 * (8.0**3 if isinstance(damping, FactorDamping) else 2 * 4 * 8))
    assert step.expected > 0


def test_a_descent_ends_where_no_step_can_be_computed() -> None:
    def flat(here: Valley, damping: Damping) -> Step[Valley] | None:
        return lower_point(here, Quadratic(np.zeros((2, 2)), np.ones(2)), here.moved, damping, 8)

    start = Valley(0.0, 0.0)
    assert minimised(start, flat, lambda *_: True, GainRatioDamping(1.0), 5) == (start, False)


@given(st.integers(0, 1000), st.tuples(UNITS, UNITS, UNITS))
def test_the_scaled_inverse_is_the_inverse_in_any_units(seed: int, units: tuple[float, float, float]) -> None:
    normal, _ = quadratic(seed)
    scale = np.array(units)
    inverse = scaled_inverse(normal * np.outer(scale, scale)) * np.outer(scale, scale)
    assert inverse == pytest.approx(np.linalg.inv(normal), rel=1e-6, abs=1e-9)


def test_an_undetermined_parameter_does_not_spoil_the_others() -> None:
    assert scaled_inverse(np.diag([4.0, 0.0]))[0, 0] == pytest.approx(0.25)


SIDES = ((0.0, inf), (-inf, inf), (-1.0, 1.0), (0.0, 2.0), (0.5, 3.0), (-2.0, 0.0))
SLACK = 1e-6
"""Tolerance on a derivative of the cost, over the product of a row's length and the target's."""


def problem(seed: int, alike: float) -> tuple[Matrix, Vector, list[tuple[float, float]]]:
    """Rows of very different lengths that have much in common, and a target that would leave the bounds."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 8))
    rows = rng.standard_normal((count, 60)) + alike * rng.standard_normal(60)
    rows *= 10.0 ** rng.uniform(-3, 3, (count, 1))
    bounds = [SIDES[i] for i in rng.integers(0, len(SIDES), count)]
    size = np.linalg.norm(rows, axis=1)
    bounds = [(low / length, high / length) for (low, high), length in zip(bounds, size, strict=True)]
    amplitudes = 2 * rng.standard_normal(count) / size
    return rows, amplitudes @ rows + 0.3 * rng.standard_normal(60), bounds


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1.0, 10.0]))
def test_no_change_within_the_bounds_lowers_the_cost(seed: int, alike: float) -> None:
    rows, target, bounds = problem(seed, alike)
    best = bounded_least_squares(rows, target, bounds)
    slope = rows @ (best @ rows - target) / (np.linalg.norm(rows, axis=1) * np.linalg.norm(target))
    for value, derivative, (low, high) in zip(best, slope, bounds, strict=True):
        assert low <= value <= high
        assert derivative > -SLACK or value == high
        assert derivative < SLACK or value == low


def test_what_other_rows_can_do_all_of_gets_the_least_amplitudes() -> None:
    row = np.random.default_rng(1).standard_normal(50)
    assert bounded_least_squares(np.array([row, row]), row, [(0.0, inf)] * 2) == pytest.approx([0.5, 0.5])
    best = bounded_least_squares(np.array([row, row]), row, [(0.0, 0.2), (0.0, inf)])
    assert best == pytest.approx([0.2, 0.8], rel=1e-6)


def test_a_row_of_nothing_has_the_amplitude_nearest_to_none() -> None:
    rows = np.array([np.zeros(50), np.ones(50)])
    assert bounded_least_squares(rows, 3 * np.ones(50), [(0.5, 2.0), (0.0, inf)]) == pytest.approx([0.5, 3.0])
    assert bounded_least_squares(rows[:1], np.ones(50), [(-3.0, -1.0)]) == pytest.approx([-1.0])
    assert bounded_least_squares(np.zeros((0, 50)), np.ones(50), []).size == 0
