"""Each side of the moat has its own gap and its own wall."""

import numpy as np
import pytest
from excitations import equal_cycles, layer_force


def test_each_side_is_free_within_its_gap_and_linear_beyond() -> None:
    given = equal_cycles(100.0, count=1, amplitude=0.3)
    force = layer_force({"moat": {"gap": 0.1, "gap_back": 0.2, "wall": 1e9, "wall_back": 3e9}}, given)
    u = given.displacement
    exact = np.select([u > 0.1, u < -0.2], [1e9 * (u - 0.1), 3e9 * (u + 0.2)], 0.0)
    assert force == pytest.approx(exact)
