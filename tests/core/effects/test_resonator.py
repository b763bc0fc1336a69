"""Oscillators behind a spring: driven by the motion of the layer, and by the ground."""

from dataclasses import replace

import numpy as np
import pytest
from excitations import TURN, equal_cycles, layer_force


@pytest.mark.parametrize("frequency", [0.5, 0.7, 1.4])
def test_harmonic_force_is_by_the_dynamic_stiffness(frequency: float) -> None:
    """-m ω² (1 + 2iζr) / (1 - r² + 2iζr), r = ω over the resonator's own; 2e-3: straight lines between samples."""
    given, mass, damping = equal_cycles(200.0, count=40, amplitude=0.1), 5e5, 0.1
    force = layer_force({"resonator": {"mass": mass, "frequency": frequency, "damping": damping}}, given)
    last = slice(-given.velocity.size // 40, None)
    wave = np.column_stack([given.displacement, given.velocity / TURN])[last]
    result = np.linalg.lstsq(wave, force[last], rcond=None)[0] @ [1, 1j]
    r = TURN / (2 * np.pi * frequency)
    exact = -mass * TURN**2 * (1 + 2j * damping * r) / (1 - r**2 + 2j * damping * r)
    assert abs(result - exact) < 2e-3 * abs(exact)


@pytest.mark.parametrize("frequency", [0.5, 0.7, 1.4])
def test_a_mass_on_a_resting_layer_transmits_the_ground_as_an_oscillator_does(frequency: float) -> None:
    """m a_g (1 + 2iζr) / (1 - r² + 2iζr), r = ω over the mass' own, the slab moving as the ground does."""
    cycles, mass, damping = equal_cycles(200.0, count=40, amplitude=1.0), 5e5, 0.1
    rest = np.zeros(cycles.velocity.size)
    given = replace(
        cycles, displacement=rest, velocity=rest, conditions=replace(cycles.conditions, ground=cycles.displacement)
    )
    force = layer_force({"tuned_mass": {"mass": mass, "frequency": frequency, "damping": damping}}, given)
    last = slice(-cycles.velocity.size // 40, None)
    wave = np.column_stack([cycles.displacement, cycles.velocity / TURN])[last]
    result = np.linalg.lstsq(wave, force[last], rcond=None)[0] @ [1, 1j]
    r = TURN / (2 * np.pi * frequency)
    exact = mass * (1 + 2j * damping * r) / (1 - r**2 + 2j * damping * r)
    assert abs(result - exact) < 2e-3 * abs(exact)
