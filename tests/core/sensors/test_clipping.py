"""What lies flat at a limit is told from what is only coarse."""

import numpy as np
import pytest

from core.arrays import Vector
from core.sensors.clipping import clipped_samples

RATE = 100.0
STEP = 1e-5


def motion(seed: int, frequency: float, amplitude: float) -> Vector:
    """One frequency whose amplitude waxes and wanes, so that few peaks are alike."""
    rng = np.random.default_rng(seed)
    time = np.arange(6000) / RATE
    growth = 1 + 0.5 * np.sin(2 * np.pi * time / 40 + rng.uniform(0, 6))
    swing = growth * np.sin(2 * np.pi * frequency * time + rng.uniform(0, 6))
    return np.asarray(amplitude * swing / np.abs(swing).max())


@pytest.mark.parametrize("amplitude", [0.001, 0.004, 0.08])
@pytest.mark.parametrize("frequency", [0.25, 0.5, 1.0])
def test_a_coarse_peak_is_not_clipped(frequency: float, amplitude: float) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        exact = motion(seed, frequency, amplitude)
        for noise in (0.0, STEP):
            coarse = np.round((exact + noise * rng.standard_normal(exact.size)) / STEP) * STEP
            assert clipped_samples(coarse) == 0


@pytest.mark.parametrize("step", [1e-9, STEP])
@pytest.mark.parametrize("limit", [0.5, 0.8])
@pytest.mark.parametrize("frequency", [0.5, 1.0, 4.0])
def test_what_a_limit_cuts_is_counted(frequency: float, limit: float, step: float) -> None:
    for seed in range(10):
        exact = motion(seed, frequency, 0.02)
        cut = np.round(np.clip(exact, -limit * 0.02, limit * 0.02) / step) * step
        at_limit = np.abs(cut) >= np.abs(cut).max() - step / 2
        assert clipped_samples(cut) == at_limit.sum()


def test_a_channel_without_motion_is_not_clipped() -> None:
    assert clipped_samples(np.zeros(100)) == 0
