"""Scragging: what the largest past displacement takes away."""

import numpy as np
import pytest
from excitations import equal_cycles, excitation, layer_force


def test_the_largest_past_displacement_is_followed() -> None:
    """Force by the running maximum; 1 % of the largest force: within a step or two of its passing."""
    given = excitation(100.0, seconds=20.0, amplitude=0.08)
    force = layer_force({"mullins": {"k_M": 1e8, "u_M": 0.025}}, given)
    exact = 1e8 * given.displacement * np.exp(-np.maximum.accumulate(abs(given.displacement)) / 0.025)
    assert force == pytest.approx(exact, abs=1e-2 * abs(exact).max())


def test_a_second_loop_is_softer_than_the_first_and_as_soft_as_the_third() -> None:
    given = equal_cycles(350.0, count=3, amplitude=0.05)
    first, second, third = np.split(
        layer_force({"mullins": {"k_M": 1e8, "u_M": 0.02}}, given)[: given.velocity.size // 3 * 3], 3
    )
    rising = slice(1, first.size // 16)
    assert (second[rising] < 0.25 * first[rising]).all()
    assert third.max() == pytest.approx(second.max(), rel=1e-3)
