import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.errors import ModelError
from core.estimators.expansion import assumed_stiffness, expanded, modal_acceleration, static_shapes

seeds = st.integers(0, 2**32 - 1)


def test_a_uniform_chain_deflects_in_a_straight_line() -> None:
    """Exact: without load between them, springs in series share the displacement evenly."""
    shapes = static_shapes(np.full(6, 1e9), np.array([2, 5]))
    assert shapes[:, 0] == pytest.approx([1 / 3, 2 / 3, 1, 2 / 3, 1 / 3, 0])
    assert shapes[:, 1] == pytest.approx([0, 0, 0, 1 / 3, 2 / 3, 1])


def test_floors_above_the_highest_sensor_move_with_it() -> None:
    assert static_shapes(np.ones(4), np.array([1]))[:, 0] == pytest.approx([0.5, 1, 1, 1])


@given(seed=seeds, floors=st.integers(1, 12))
def test_shapes_keep_what_was_measured_and_ignore_the_stiffness_scale(seed: int, floors: int) -> None:
    rng = np.random.default_rng(seed)
    measured = np.sort(rng.choice(floors, rng.integers(1, floors + 1), replace=False))
    stiffness, shapes = rng.uniform(1e8, 1e10, floors), rng.standard_normal((measured.size, 3))
    full = expanded(shapes, stiffness, measured)
    assert full[measured] == pytest.approx(shapes)
    assert expanded(shapes, 7 * stiffness, measured) == pytest.approx(full)


@given(seed=seeds)
def test_modal_coordinates_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    measured = np.array([0, 2, 5])
    # Well-conditioned shapes, so that rounding stays below the default tolerance.
    shapes = expanded(np.linalg.qr(rng.standard_normal((3, 3))).Q[:, :2], assumed_stiffness(np.ones(6)), measured)
    modal = rng.standard_normal((2, 50))
    assert modal_acceleration(shapes, measured, shapes[measured] @ modal) == pytest.approx(modal)


@pytest.mark.parametrize("measured", [[], [3, 2], [1, 1], [6], [-1]])
def test_refuses_floors_that_are_not_there(measured: list[int]) -> None:
    with pytest.raises(ModelError, match=r"must rise within 0 \.\.\. 5"):
        static_shapes(np.ones(6), np.array(measured, dtype=int))


def test_refuses_a_storey_without_stiffness() -> None:
    with pytest.raises(ModelError, match="must be positive"):
        static_shapes(np.array([1.0, 0.0]), np.array([1]))
