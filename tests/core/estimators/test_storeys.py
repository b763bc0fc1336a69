"""What a record adds to what was believed of the storeys is got back, whatever was believed."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.estimators.storeys import StoreyStiffness


@given(st.integers(1, 8), st.integers(0, 1000), st.floats(0.05, 10.0))
def test_information_is_what_the_record_adds(floors: int, seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((floors, floors + 3)) / 0.05
    added = rows @ rows.T
    believed = spread**2 * (np.eye(floors) + 0.5)
    covariance = np.linalg.inv(added + np.linalg.inv(believed))
    found = StoreyStiffness(np.zeros(floors), covariance, believed).information
    assert found == pytest.approx(added, rel=1e-6, abs=1e-8 * np.abs(added).max())


def test_a_record_that_says_nothing_of_a_storey_adds_nothing() -> None:
    believed = np.diag([0.09, 0.04])
    known = StoreyStiffness(np.zeros(2), np.diag([0.0001, 0.04]), believed).information
    assert known == pytest.approx(np.diag([1e4 - 1 / 0.09, 0.0]), abs=1e-9)
