from dataclasses import replace

import numpy as np
import pytest
from exact_spectra import DESIGN, unrelated_lines

from core.arrays import Vector
from core.estimators.frame.free_vibration import (
    floors_free_vibration,
    free_vibration,
    free_vibration_changes,
    free_vibration_columns,
)
from core.estimators.frame.model import superstructure

LAYOUT = DESIGN.layout
FLOORS = np.array([2, 6])
STEP = 1e-5
"""Step of central differences."""


def parameters(seed: int) -> Vector:
    """Structural ones at random, sensors and transients at rest."""
    result = np.zeros(LAYOUT.size)
    result[: LAYOUT.structural] = 0.3 * np.random.default_rng(seed).standard_normal(LAYOUT.structural)
    result[LAYOUT.flexibilities] += np.log([0.1, 0.3, 0.05])
    result[LAYOUT.damping] += np.log([0.002, 0.02, 0.1])
    return result


@pytest.mark.parametrize("samples", [200, 1001])
def test_free_vibration_is_the_transform_of_its_samples(samples: int) -> None:
    """At every line of the discrete Fourier transform, whether the vibration has died away by the end or not."""
    structure, rate = superstructure(parameters(3), DESIGN), 50.0
    angular: Vector = np.asarray(2 * np.pi * np.fft.rfftfreq(samples, 1 / rate), dtype=float)
    result = free_vibration(structure, angular, samples, rate)
    ω, ζ = 2 * np.pi * structure.frequencies[:, None], structure.damping_ratios[:, None]
    vibration = np.exp((-ζ + 1j * np.sqrt(1 - ζ**2)) * ω * np.arange(samples) / rate)
    exact = np.fft.rfft(np.stack([vibration.real, vibration.imag], axis=1), axis=2)
    assert np.abs(result - exact).max() < 1e-10 * np.abs(exact).max()


def test_free_vibration_stays_one_where_damping_is_beyond_critical() -> None:
    """While a calibration tries damping of no sense."""
    structure = replace(superstructure(parameters(3), DESIGN), damping=np.array([1.0, 1.0, 1.0]))
    assert structure.damping_ratios.max() > 1
    assert np.isfinite(free_vibration(structure, np.linspace(0.1, 60, 50), 500, 100.0)).all()


def test_floors_move_by_the_sum_of_all_modes() -> None:
    rng = np.random.default_rng(4)
    lines, structure = unrelated_lines(rng, at_rest=False), superstructure(parameters(4), DESIGN)
    amplitudes = rng.standard_normal(2 * LAYOUT.floors)
    moved = floors_free_vibration(structure, lines, FLOORS, amplitudes)
    assert moved == pytest.approx(np.tensordot(amplitudes, free_vibration_columns(structure, lines, FLOORS), 1))
    assert not floors_free_vibration(structure, replace(lines, at_rest=True), FLOORS, amplitudes).any()


@pytest.mark.parametrize("seed", range(3))
def test_changes_are_those_of_the_floors(seed: int) -> None:
    """Against central differences, right to 1e-8 of the largest."""
    rng, at = np.random.default_rng(5), parameters(seed)
    lines, amplitudes = unrelated_lines(rng, at_rest=False), rng.standard_normal(2 * LAYOUT.floors)
    result = free_vibration_changes(superstructure(at, DESIGN), lines, FLOORS, amplitudes)
    assert len(result) == LAYOUT.structural
    for place, change in enumerate(result):
        move = STEP * (np.arange(LAYOUT.size) == place)
        ahead, behind = (
            floors_free_vibration(superstructure(at + way * move, DESIGN), lines, FLOORS, amplitudes) for way in (1, -1)
        )
        difference = (ahead - behind) / (2 * STEP)
        assert np.abs(change - difference).max() < 1e-6 * np.abs(result).max()
