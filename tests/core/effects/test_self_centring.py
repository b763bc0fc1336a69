"""The flag: back to zero at zero displacement, and as high as it says on the way there and back."""

import numpy as np
import pytest
from excitations import equal_cycles, layer_force


def test_the_flag_has_its_two_levels_and_returns_to_zero() -> None:
    given = equal_cycles(700.0, count=2, amplitude=0.1)
    force = layer_force({"self_centring": {"activation": 2e6, "lost": 0.6, "opening": 2e-3}}, given)
    u, v, last = given.displacement, given.velocity, slice(given.velocity.size // 2, None)
    out, back = (force[last][(u * v)[last] * sign > 1e-2] for sign in (1, -1))
    assert abs(out).max() == pytest.approx(2e6, rel=1e-3)
    assert np.median(abs(back)) == pytest.approx(0.4 * 2e6, rel=1e-2)
    assert (abs(force) <= 2e6 * abs(u) / 2e-3 + 1e-6).all()
    assert (force * u >= 0).all()
