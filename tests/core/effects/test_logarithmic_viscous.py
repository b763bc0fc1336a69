"""The logarithmic damper: a block's exact motion, and Eyring's force at low and high speed."""

import numpy as np
import pytest
from excitations import TURN, equal_cycles, layer_force
from scipy import integrate

from core.building import ShearBuilding
from core.model.isolator import Isolator
from core.model.simulation import simulate

INCREASE, SPEED = 1e6, 0.02
VALUES = {"logarithmic_viscous": {"increase": INCREASE, "speed": SPEED}}


def test_a_block_comes_to_rest_as_in_an_independent_integration() -> None:
    """m v' = −F asinh(v / s) / ln 10, by SciPy's DOP853."""
    rate, blow, mass = 500.0, np.zeros(600), 1e6
    blow[1:26] = -4.0
    building = ShearBuilding(mass / 2, np.array([mass / 2]), np.array([1e5 * mass * TURN**2]), 1e-5)
    after = simulate(building, Isolator(VALUES), blow, rate).isolator_velocity[50:]
    time = np.arange(after.size) / rate
    exact = integrate.solve_ivp(
        lambda _, v: -INCREASE * np.arcsinh(v / SPEED) / np.log(10) / mass,
        (0.0, time[-1]),
        after[:1],
        "DOP853",
        time,
        rtol=1e-10,
        atol=1e-12,
    )
    assert after[0] > 3 * SPEED
    assert np.abs(after - exact.y[0]).max() < 1e-4 * after[0]


def test_every_tenfold_speed_adds_the_same_force() -> None:
    given = equal_cycles(700.0, count=1, amplitude=0.1)
    fast, faster = (
        layer_force({"logarithmic_viscous": {"increase": INCREASE, "speed": speed}}, given) for speed in (1e-3, 1e-4)
    )
    moving = np.abs(given.velocity) > 0.1
    assert moving.any()
    assert np.abs(faster - fast)[moving] == pytest.approx(INCREASE, rel=1e-4)


def test_below_its_speed_it_is_a_dashpot() -> None:
    given = equal_cycles(700.0, count=1, amplitude=1e-4)
    dashpot = INCREASE / np.log(10) / SPEED * given.velocity
    assert layer_force(VALUES, given) == pytest.approx(dashpot, rel=1e-4)
