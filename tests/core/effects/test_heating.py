"""Heating of a lead core by motion in both directions."""

from dataclasses import replace

import numpy as np
import pytest
from excitations import LAYER, Excitation, equal_cycles, layer_force

from core.model.isolator import Conditions

YIELD = {"bouc_wen": {**LAYER["bouc_wen"], "F_y": 1.0}}
RATE = 200.0
HEAT = {"loss": 0.5, "recovery": 4.0}


def test_without_motion_across_the_core_warms_by_its_own_direction() -> None:
    given = equal_cycles(RATE, count=4)
    one, both = (layer_force({**YIELD, name: HEAT}, given) for name in ("heating", "biaxial_heating"))
    assert both == pytest.approx(one, abs=1e-12)


@pytest.mark.parametrize(("along", "across"), [(0.05, 0.2), (0.1, -0.1), (0.2, 0.02)])
def test_strength_falls_with_the_work_of_both_directions(along: float, across: float) -> None:
    """At constant speeds z = 1 along, z_c = (-v + √(v² + 4 v_c²)) / 2 v_c across, and the warming tends to its end with
    the time constant of the cooling: loss P τ (1 - exp(-t / τ)), P = v + z_c v_c. 1 %: the travel before it yields."""
    t = np.arange(0.0, 6.0, 1 / RATE)
    usual = Conditions.usual(t.size, RATE)
    moving = replace(usual, u_cross=across * t, v_cross=np.full(t.size, across))
    force = layer_force({**YIELD, "biaxial_heating": HEAT}, Excitation(RATE, along * t, np.full(t.size, along), moving))
    z_cross = (-along + np.sqrt(along**2 + 4 * across**2)) / (2 * across)
    warming = HEAT["loss"] * (along + z_cross * across) * HEAT["recovery"] * -np.expm1(-t / HEAT["recovery"])
    late = t > 2.0
    assert force[late] == pytest.approx(np.exp(-warming)[late], rel=1e-2)


def test_motion_across_alone_warms_the_core_too() -> None:
    """After 3 s at 0.2 m/s across, a first push has exp(-loss v τ (1 - exp(-3 / τ))) of the cold force, and less."""
    t = np.arange(0.0, 3.5, 1 / RATE)
    begins = t > 3.0
    u, v = np.where(begins, 0.1 * (t - 3.0), 0.0), np.where(begins, 0.1, 0.0)
    across = replace(Conditions.usual(t.size, RATE), u_cross=0.2 * t, v_cross=np.full(t.size, 0.2))
    warm = layer_force({**YIELD, "biaxial_heating": HEAT}, Excitation(RATE, u, v, across))
    cold = layer_force(YIELD, Excitation(RATE, u, v, across))
    just = np.searchsorted(t, 3.05)
    expected = np.exp(-HEAT["loss"] * 0.2 * HEAT["recovery"] * -np.expm1(-3.05 / HEAT["recovery"]))
    assert warm[just] / cold[just] == pytest.approx(expected, rel=1e-2)
