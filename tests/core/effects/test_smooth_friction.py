"""Smooth friction: a sliding block's exact motion, and the work in a harmonic cycle."""

import numpy as np
import pytest
from excitations import TURN, equal_cycles, layer_force
from scipy import integrate

from core.building import ShearBuilding
from core.model.isolator import Isolator
from core.model.simulation import simulate

FORCE, SPEED = 1e6, 0.02


def test_a_sliding_block_comes_to_rest_as_the_exact_solution_does() -> None:
    """m v' = −F tanh(v / s) has the solution sinh(v / s) = sinh(v₀ / s) exp(−F t / (m s))."""
    rate, blow, mass = 500.0, np.zeros(600), 1e6
    blow[1:26] = -4.0
    building = ShearBuilding(mass / 2, np.array([mass / 2]), np.array([1e5 * mass * TURN**2]), 1e-5)
    layer = Isolator({"smooth_friction": {"sliding": FORCE, "speed": SPEED, "shape": 1.0}})
    moved = simulate(building, layer, blow, rate)
    after = moved.isolator_velocity[50:]
    time = np.arange(after.size) / rate
    exact = SPEED * np.arcsinh(np.sinh(after[0] / SPEED) * np.exp(-FORCE * time / (mass * SPEED)))
    assert after[0] > 3 * SPEED
    assert np.abs(after - exact).max() < 1e-4 * after[0]


@pytest.mark.parametrize("speed", [1e-3, 0.05, 0.4])
def test_the_work_in_a_cycle_is_that_of_the_law(speed: float) -> None:
    """∮ F v dt, which approaches 4 F u as the speed falls."""
    amplitude, given = 0.1, equal_cycles(700.0, count=1, amplitude=0.1)
    force = layer_force({"smooth_friction": {"sliding": FORCE, "speed": speed, "shape": 1.0}}, given)
    largest = amplitude * TURN
    turn, _ = integrate.quad(lambda phase: np.tanh(largest * np.sin(phase) / speed) * np.sin(phase), 0.0, np.pi)
    work = 2.0 * FORCE * amplitude * turn
    assert np.sum(force * given.velocity) / given.rate == pytest.approx(work, rel=1e-3)
    assert work < 4 * FORCE * amplitude


def test_in_another_form_it_grows_exponentially() -> None:
    """Threlfall (1978): 1 − exp(−x)."""
    given = equal_cycles(100.0, count=1)
    force = layer_force({"smooth_friction": {"sliding": FORCE, "speed": SPEED, "shape": 0.0}}, given)
    exact = FORCE * np.sign(given.velocity) * -np.expm1(-2.0 * np.abs(given.velocity) / SPEED)
    assert force == pytest.approx(exact, rel=1e-12, abs=1e-6)
