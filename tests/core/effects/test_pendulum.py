"""A pendulum under a changing load: a dish of a radius, and its work in a cycle."""

from dataclasses import replace

import numpy as np
import pytest
from excitations import TURN, equal_cycles, layer_force

from core.building import ShearBuilding
from core.model.isolator import Isolator
from core.model.simulation import simulate

RADIUS, WEIGHT, GRAVITY = 2.0, 3.0e7, 9.80665
HANGING = {"pendulum": {"hanging": WEIGHT / RADIUS}}


def test_under_dead_load_it_swings_as_a_pendulum_of_its_radius() -> None:
    """T = 2π √(R / g), whatever the mass."""
    mass, rate = WEIGHT / GRAVITY, 200.0
    building = ShearBuilding(mass / 2, np.array([mass / 2]), np.array([1e5 * mass * TURN**2]), 1e-5)
    blow = np.zeros(4000)
    blow[1:41] = -1.0
    moved = simulate(building, Isolator(HANGING), blow, rate).isolator_displacement[100:]
    crossings = np.flatnonzero(np.diff(np.sign(moved)))
    exact = crossings - moved[crossings] / (moved[crossings + 1] - moved[crossings])
    period = 2 * np.diff(exact).mean() / rate
    assert period == pytest.approx(2 * np.pi * np.sqrt(RADIUS / GRAVITY), rel=2e-4)


def test_the_force_is_the_load_of_the_moment_over_the_radius() -> None:
    """Lifted off, it does not restore."""
    given = equal_cycles(100.0, count=2, amplitude=0.2)
    load = 1.0 + 1.2 * np.sin(7 * np.arange(given.displacement.size) / given.rate)
    assert load.min() < 0
    force = layer_force(HANGING, replace(given, conditions=replace(given.conditions, axial_load=load)))
    assert force == pytest.approx(WEIGHT * np.maximum(load, 0.0) * given.displacement / RADIUS, rel=1e-12, abs=1e-6)


def test_a_load_at_twice_the_frequency_gives_or_takes_work() -> None:
    """∮ N u v dt / R of the load W (1 + a sin 2ωt) on u₀ sin ωt is π a W u₀² / 2R."""
    given = equal_cycles(2000.0, count=1, amplitude=0.2)
    time = np.arange(given.displacement.size) / given.rate
    load = 1.0 + 0.3 * np.sin(2 * TURN * time)
    force = layer_force(HANGING, replace(given, conditions=replace(given.conditions, axial_load=load)))
    work = np.sum(force * given.velocity) / given.rate
    assert work == pytest.approx(np.pi * 0.3 * WEIGHT * 0.2**2 / (2 * RADIUS), rel=1e-3)
