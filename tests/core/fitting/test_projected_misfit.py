"""Amplitudes within bounds are the best there are, by the conditions of Karush, Kuhn and Tucker."""

from math import inf

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.arrays import Matrix, Vector
from core.fitting.projected_misfit import bounded_least_squares

SIDES = ((0.0, inf), (-inf, inf), (-1.0, 1.0), (0.0, 2.0), (0.5, 3.0), (-2.0, 0.0))
SLACK = 1e-6
"""Of a row's length times the target's: a derivative of the cost that is none."""


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
