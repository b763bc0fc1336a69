"""The offset: what a yielding damper that was left locked remembers, and the energy it had stored."""

import numpy as np
import pytest
from excitations import Excitation, equal_cycles, layer_force

from core.model.isolator import Conditions


def test_it_is_what_the_locked_damper_forgets() -> None:
    """Two runs of a damper with β = 0, one of them locked by a push, differ by an exponential of the travel."""
    D_y, F_y, rate = 5e-3, 1e6, 400.0
    damper = {"bouc_wen": {"F_y": F_y, "D_y": D_y, "A": 1.0, "beta": 0.0, "gamma": 1.0, "n": 1.0}}
    given = equal_cycles(rate, count=2, amplitude=0.02)
    push = np.linspace(0.0, 1e-3, 200)
    u = np.concatenate([push, 1e-3 + given.displacement])
    v = np.concatenate([np.gradient(push, 1 / rate), given.velocity])
    locked = layer_force(damper, Excitation(rate, u, v, Conditions.usual(u.size, rate)))[200:]
    offset = layer_force({"residual_offset": {"held_force": -locked[0], "travel": D_y}}, given)
    assert locked - layer_force(damper, given) == pytest.approx(offset + locked[0], abs=1e-2 * locked[0])


def test_it_gives_no_more_energy_than_was_held() -> None:
    """Over whole cycles the work is at most the held force over its travel, and half a sample that the sum adds."""
    for sign in (-1, 1):
        given = equal_cycles(700.0, count=5, amplitude=0.1)
        force = layer_force({"residual_offset": {"held_force": sign * 1e6, "travel": 5e-3}}, given)
        assert (
            abs(np.sum(force * given.velocity) / given.rate) < 1e6 * (5e-3 + given.velocity[0] / given.rate / 2) * 1.01
        )
