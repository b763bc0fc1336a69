"""The relieved oil damper, together with its dashpot."""

import numpy as np
import pytest
from excitations import equal_cycles, layer_force


def test_beyond_relief_the_damper_follows_its_second_slope() -> None:
    given = equal_cycles(200.0, count=1, amplitude=0.1)
    force = layer_force({"viscous": {"c_b": 5e6}, "relief": {"relieved": 4e6, "v_r": 0.15}}, given)
    speed = abs(given.velocity)
    published = np.where(speed < 0.15, 5e6 * speed, 5e6 * 0.15 + 1e6 * (speed - 0.15))
    assert force * np.sign(given.velocity) == pytest.approx(published)
