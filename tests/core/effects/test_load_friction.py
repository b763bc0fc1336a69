"""Friction that follows the vertical load: exact values under a load that changes, and without one."""

from dataclasses import replace

import numpy as np
import pytest
from excitations import TURN, Excitation, equal_cycles, layer_force, usual_values

from core.model.isolator import Conditions

SLIDING, FOLLOWING, SHARE, RATE, A = 1e6, 8e5, 0.4, 400.0, 20.0
"""N, N, 1, Hz and s/m."""
VALUES = usual_values("load_friction", sliding=SLIDING, following=FOLLOWING, share=SHARE, a=A, slip=1e-4)


@pytest.mark.parametrize("speed", [0.1, -0.3])
def test_the_force_follows_the_load_at_every_instant(speed: float) -> None:
    """μ(v) N(t), after the slip; the load swings by half of the weight."""
    t = np.arange(800) / RATE
    load = 1.0 + 0.5 * np.sin(3 * TURN * t)
    given = Excitation(
        RATE, speed * t, np.full(t.size, speed), replace(Conditions.usual(t.size, RATE), axial_load=load)
    )
    exact = np.sign(speed) * (SLIDING + FOLLOWING * (load - 1.0)) * (1.0 - SHARE * np.exp(-A * abs(speed)))
    force = layer_force({"load_friction": VALUES}, given)
    slid = np.abs(given.displacement) > 1e-2
    assert force[slid] == pytest.approx(exact[slid], rel=1e-6)


def test_no_force_acts_while_the_bearing_is_lifted() -> None:
    given = equal_cycles(RATE, count=1)
    lifted = replace(given, conditions=replace(given.conditions, axial_load=np.full(given.velocity.size, -0.2)))
    assert np.abs(layer_force({"load_friction": {**VALUES, "following": SLIDING}}, lifted)).max() == 0.0


def test_under_dead_load_it_is_friction_of_the_same_values() -> None:
    """The friction of Constantinou et al. (1990), by the law that knows no load; the slip is long enough for both."""
    given = equal_cycles(RATE, count=2)
    alone = usual_values("friction", sliding=SLIDING, share=SHARE, a=A, slip=1e-2)
    force = layer_force({"load_friction": {**VALUES, "slip": 1e-2}}, given)
    assert force == pytest.approx(layer_force({"friction": alone}, given), abs=1e-6 * SLIDING)
