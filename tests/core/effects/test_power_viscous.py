"""The power-law damper's work in a harmonic cycle."""

import numpy as np
import pytest
from excitations import TURN, equal_cycles, layer_force, usual_values
from scipy.special import gamma


@pytest.mark.parametrize("exponent", [0.1, 0.3, 1.0, 2.0])
def test_the_area_of_a_loop_is_the_published_one(exponent: float) -> None:
    """Soong & Constantinou (1994): λ F u with λ = 4 · 2^α Γ²(1 + α/2) / Γ(2 + α), F the largest force.

    3e-3: the sum over samples, where the force leaps with the sign of the velocity."""
    amplitude, given = 0.1, equal_cycles(700.0, count=1, amplitude=0.1)
    force = layer_force({"power_viscous": usual_values("power_viscous", force=1e6, exponent=exponent)}, given)
    largest = 1e6 * (amplitude * TURN / 0.1) ** exponent
    published = 4 * 2**exponent * gamma(1 + exponent / 2) ** 2 / gamma(2 + exponent) * largest * amplitude
    assert np.sum(force * given.velocity) / given.rate == pytest.approx(published, rel=3e-3)
