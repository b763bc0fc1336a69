"""Samples that a recorder made up are recognised and named; sensors at their limit and layers that stick are not."""

from collections.abc import Callable

import numpy as np
import pytest
from building_models import ROOF, paper, records, segments
from hypothesis import given, settings, strategies as st
from paper_records import START

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.record import Trace
from core.sensors.filled_gaps import LAST_VALUE, LINE, ZEROS, filled_gaps

RATE = 100.0
COUNT = 6000


def shaking(seed: int, steps: int) -> Vector:
    """(6000,) m/s², of a digitiser with so many steps to the largest value."""
    rng = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    strong = 0.05 + np.exp(-(((time - 25) / 12) ** 2))
    moved = strong * rng.standard_normal(COUNT)
    moved = np.convolve(moved, np.hanning(5) / 2, "same")
    step = np.abs(moved).max() / steps
    return np.asarray(np.round(moved / step) * step)


def held(samples: Vector, first: int, stop: int) -> Vector:
    samples[first:stop] = samples[first - 1]
    return samples


def zeroed(samples: Vector, first: int, stop: int) -> Vector:
    samples[first:stop] = 0.0
    return samples


def lined(samples: Vector, first: int, stop: int) -> Vector:
    samples[first - 1 : stop + 1] = np.linspace(samples[first - 1], samples[stop], stop - first + 2)
    return samples


FILLS: dict[str, Callable[[Vector, int, int], Vector]] = {LAST_VALUE: held, ZEROS: zeroed, LINE: lined}


@pytest.mark.parametrize("kind", FILLS)
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(300, 5000), st.integers(8, 200))
def test_what_the_recorder_wrote_is_named(kind: str, seed: int, first: int, count: int) -> None:
    """Within a sample, and but for a value near the channel's largest: a sensor at its limit looks the same."""
    samples = FILLS[kind](shaking(seed, 2**20), first, first + count)
    found = filled_gaps(Trace(START, RATE, samples), "acceleration")
    if not found and np.abs(samples[first]) > 0.99 * np.abs(samples).max():
        return
    assert [one.kind for one in found] == [kind]
    assert abs(found[0].first - first) <= 1
    assert abs(found[0].stop - (first + count)) <= 1


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([20, 200, 2**12, 2**16, 2**23]))
def test_a_measured_motion_has_none_however_coarse(seed: int, steps: int) -> None:
    assert filled_gaps(Trace(START, RATE, shaking(seed, steps)), "acceleration") == ()


def test_a_sensor_at_its_limit_lost_no_samples() -> None:
    samples = shaking(1, 2**20)
    limit = 0.3 * np.abs(samples).max()
    samples = np.convolve(np.clip(np.repeat(samples[::10], 10), -limit, limit), np.ones(3) / 3, "same")
    assert filled_gaps(Trace(START, RATE, np.clip(samples, -limit, limit)), "acceleration") == ()


def test_a_layer_that_sticks_rests_within_its_motion() -> None:
    """It starts with a finite acceleration: its displacement leaves the rest without a jump."""
    time = np.arange(COUNT) / RATE
    slips = np.maximum(np.sin(2 * np.pi * 0.3 * time), 0.0) ** 2 * np.sign(np.sin(2 * np.pi * 0.15 * time + 0.1))
    displacement = np.round(np.cumsum(0.3 * slips) / RATE / 1e-5) * 1e-5
    assert np.sum(np.diff(displacement) == 0) > COUNT / 4
    assert filled_gaps(Trace(START, RATE, displacement), "displacement") == ()


def test_a_channel_with_a_long_filled_gap_is_left_out_and_the_message_says_with_what() -> None:
    samples = records(3)
    samples[ROOF] = held(samples[ROOF].copy(), 5000, 5080)
    found = analyse(segments(samples), paper(), AnalysisSettings(estimator="cms")).quality
    (gap,) = [one for one in found if one.kind == "gap"]
    assert (gap.severity, gap.channel) == ("warning", ROOF)
    assert "the recorder lost them and wrote its last value in their place" in gap.message


def test_a_short_one_is_interpolated() -> None:
    samples = records(3)
    samples[ROOF] = zeroed(samples[ROOF].copy(), 5000, 5008)
    found = analyse(segments(samples), paper(), AnalysisSettings(estimator="cms")).quality
    (gap,) = [one for one in found if one.kind == "gap"]
    assert "8 samples, up to 0.08 s in a row, were interpolated" in gap.message
    assert "wrote zeros in their place" in gap.message
