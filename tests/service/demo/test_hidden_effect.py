"""The layer that does more than its engineer knows: as the paper's but for its hardening."""

from dataclasses import fields

import numpy as np
import pytest

from core.arrays import Vector
from core.model.simulation import Response, simulate
from core.paper import BUILDING, ISOLATOR
from service.demo.hidden_effect import RUBBER, Hardening, response
from service.demo.site import RATE


def shaking() -> Vector:
    """m/s², 12 s that move the layer some 200 mm: a swept sine past its frequency."""
    time = np.arange(0.0, 12.0, 1 / RATE)
    return 2.5 * np.sin(np.pi * time / 12.0) * np.sin(2 * np.pi * (0.4 + 0.04 * time) * time)


def test_without_its_hardening_it_is_the_papers_building() -> None:
    """1e-4: both are right to about 1e-5 of a peak (tests/core/model/test_simulation.py says it of the other)."""
    plain = response(shaking(), Hardening(0.0, 1.0))
    known = simulate(BUILDING, ISOLATOR, shaking(), RATE)
    for field in fields(Response):
        expected = getattr(known, field.name)
        assert getattr(plain, field.name) == pytest.approx(expected, abs=1e-4 * np.abs(expected).max()), field.name


def test_what_hardens_is_the_force_and_only_at_large_displacement() -> None:
    """The force from the floors' inertia is the layer's law, whatever the motion: 1e-9 is rounding."""
    found = response(shaking())
    u = found.isolator_displacement
    inertia = BUILDING.base_mass * found.base_acceleration + BUILDING.floor_mass @ found.floor_acceleration
    assert -inertia == pytest.approx(found.force, abs=1e-9 * np.abs(found.force).max())
    rubber, damper = ISOLATOR.effects["elastic"]["k_b"], ISOLATOR.effects["bouc_wen"]["F_y"]
    rest = found.force - rubber * u - ISOLATOR.effects["viscous"]["c_b"] * found.isolator_velocity
    hardening = RUBBER.stiffness * (RUBBER.length * np.sinh(u / RUBBER.length) - u)
    assert np.abs(u).max() > RUBBER.length
    assert np.abs(rest - hardening).max() <= damper * (1 + 1e-9)  # |z| <= 1 (Wen, 1976)
    assert np.abs(hardening[np.abs(u) < 0.05]).max() < 0.01 * rubber * np.abs(u).max()
