"""The flag: back to zero at zero displacement, and as high as it says on the way there and back."""

import numpy as np
import pytest
from excitations import equal_cycles, excitation, layer_force


def test_the_flag_has_its_two_levels_and_returns_to_zero() -> None:
    given = equal_cycles(700.0, count=2, amplitude=0.1)
    force = layer_force({"self_centring": {"activation": 2e6, "lost": 0.6, "opening": 2e-3}}, given)
    u, v, last = given.displacement, given.velocity, slice(given.velocity.size // 2, None)
    out, back = (force[last][(u * v)[last] * sign > 1e-2] for sign in (1, -1))
    assert abs(out).max() == pytest.approx(2e6, rel=1e-3)
    assert np.median(abs(back)) == pytest.approx(0.4 * 2e6, rel=1e-2)
    assert (abs(force) <= 2e6 * abs(u) / 2e-3 + 1e-6).all()
    assert (force * u >= 0).all()


@pytest.mark.parametrize(("lost", "opening"), [(0.7, 0.01), (0.3, 0.02)])
def test_the_flag_with_corners_is_elastic_between_its_two_forces(lost: float, opening: float) -> None:
    """Exact steps: the force moves by Δu / opening within the elastic line cut off at 1, and at 1 - lost; rms of it."""
    fine, given = excitation(1600.0, 5.0, 0.06), excitation(100.0, 5.0, 0.06)
    elastic = fine.displacement / opening
    opened, closing = np.clip(elastic, -1.0, 1.0), np.clip(elastic, lost - 1.0, 1.0 - lost)
    exact = np.zeros(elastic.size)
    for now, travel in enumerate(np.diff(elastic), 1):
        low, high = sorted((opened[now], closing[now]))
        exact[now] = np.clip(exact[now - 1] + travel, low, high)
    force = layer_force({"flag_shape": {"activation": 1.0, "lost": lost, "opening": opening}}, given)
    assert np.sqrt(np.mean((force - exact[::16])[:-1] ** 2)) < 2e-3
