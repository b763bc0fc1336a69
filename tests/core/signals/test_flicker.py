"""Flicker noise of accelerometers, by what floors that move together do not say in common."""

import numpy as np
import pytest

from core.arrays import Vector
from core.signals.flicker import flicker_corner, record_flicker

RATE, COUNT = 100.0, 9000
FREQUENCY: Vector = np.asarray(np.fft.rfftfreq(COUNT, 1 / RATE), dtype=float)


def coloured(rng: np.random.Generator, corner: float) -> Vector:
    """(n,) noise of density 1 + corner / f, and of variance 1 per sample without flicker."""
    lines = np.fft.rfft(rng.standard_normal(COUNT))
    lines[1:] *= np.sqrt(1 + corner / FREQUENCY[1:])
    return np.asarray(np.fft.irfft(lines, COUNT))


def moving(rng: np.random.Generator, corner: float) -> np.ndarray:
    """(3, n) a base slab that sways below 1.5 Hz a thousand times the noise, floors with more of it, and noise."""
    swaying = np.fft.irfft(np.fft.rfft(rng.standard_normal(COUNT)) * (FREQUENCY < 1.5), COUNT)
    lines = np.fft.rfft(1000 * np.hanning(COUNT) ** 2 * swaying)
    growth = [np.ones(FREQUENCY.size), 1 + 0.3 * FREQUENCY**2, 1 + 0.7 * FREQUENCY**2 - 0.02j * FREQUENCY**3]
    floors = np.array([np.fft.irfft(lines * row, COUNT) for row in growth])
    return floors + np.array([coloured(rng, corner) for _ in growth])


@pytest.mark.parametrize("seed", range(6))
def test_white_noise_has_no_corner(seed: int) -> None:
    assert record_flicker(moving(np.random.default_rng(seed), 0.0), RATE) == 0.0


@pytest.mark.parametrize("corner", [2.0, 5.0, 20.0])
def test_a_corner_is_known_roughly(corner: float) -> None:
    found = [record_flicker(moving(np.random.default_rng([seed, 7]), corner), RATE) for seed in range(6)]
    level = 1 + corner / 17.5  # the white level is read where some flicker is left: from 15 to 20 Hz
    assert found == pytest.approx([corner / level] * 6, rel=0.4)


def test_nothing_is_known_of_one_channel_nor_of_a_short_record() -> None:
    lines = np.fft.rfft(np.random.default_rng(1).standard_normal((2, COUNT)), axis=1)
    assert flicker_corner(lines[:1], np.ones(1), FREQUENCY) == 0.0
    few = np.asarray(np.fft.rfftfreq(1000, 1 / RATE), dtype=float)
    assert flicker_corner(lines[:, : few.size], np.ones(2), few) == 0.0
