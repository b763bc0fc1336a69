"""A transducer that drifts is told from a layer that comes to rest elsewhere, and from one that still moves."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.arrays import Vector
from core.sensors.creep import creep

RATE = 100.0
TIME: Vector = np.arange(6000) / RATE


def motion(peak: float, offset: float, seed: int) -> Vector:
    """(6000,) m, strong from 10 s to 25 s and then dying away, with a residual offset from 20 s on."""
    rng = np.random.default_rng(seed)
    strong = np.exp(-(((TIME - 17) / 5) ** 2)) + 0.02 * np.exp(-((TIME - 17).clip(0) / 10)) * (TIME > 17)
    waves = sum(np.sin(2 * np.pi * f * TIME + rng.uniform(0, 6)) for f in rng.uniform(0.4, 1.0, 5))
    moved = strong * waves
    settled = offset / (1 + np.exp(-(TIME - 20) / 0.5))
    return np.asarray(peak * moved / np.abs(moved).max() + settled + 1e-5 * rng.standard_normal(TIME.size))


@given(st.floats(0.004, 0.2), st.floats(-0.01, 0.01), st.integers(0, 10**6))
def test_a_residual_offset_is_no_drift(peak: float, offset: float, seed: int) -> None:
    """Three standard deviations: the bound that each block's sway is reckoned with is hardly ever reached."""
    found = creep(motion(peak, offset, seed), RATE)
    assert found is not None
    assert abs(found.change) < 3 * found.std


@given(st.floats(0.01, 0.2), st.floats(0.1, 0.5), st.integers(0, 10**6))
def test_a_steady_drift_is_found(peak: float, share: float, seed: int) -> None:
    """Of the change between the first and the last block at rest; their own motion is within the std."""
    drift = share * peak * TIME / TIME[-1]
    found = creep(motion(peak, 0.002, seed) + drift, RATE)
    assert found is not None
    assert found.change > 4 * found.std
    assert found.change == pytest.approx(found.share * np.abs(motion(peak, 0.002, seed) + drift).max())
    assert found.change < share * peak + 3 * found.std


def test_a_record_without_rest_says_nothing() -> None:
    assert creep(np.sin(2 * np.pi * 0.5 * TIME), RATE) is None
