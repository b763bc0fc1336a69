import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import signal

from core.errors import RecordError
from core.signals.noise import noise_density, noise_std

RATE = 100.0


def test_white_noise_has_its_own_std() -> None:
    """A fifth of 180 s: 36 spectra of 70 lines, half overlapping, are good to some 3 %; three times that is asked."""
    rng = np.random.default_rng(1)
    given_std = np.array([1e-3, 0.2, 7.0])
    assert noise_std(given_std[:, None] * rng.standard_normal((3, 18000)), RATE) == pytest.approx(given_std, rel=0.1)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(1e-6, 1e6))
def test_scales_with_the_record(seed: int, factor: float) -> None:
    samples = np.random.default_rng(seed).standard_normal((2, 1500))
    assert noise_std(factor * samples, RATE) == pytest.approx(factor * noise_std(samples, RATE))


def test_an_earthquake_in_the_middle_is_not_noise() -> None:
    rng = np.random.default_rng(2)
    samples = 0.01 * rng.standard_normal((1, 18000))
    samples[0, 4000:9000] += signal.windows.hann(5000) * rng.standard_normal(5000)
    assert noise_std(samples, RATE) == pytest.approx([0.01], rel=0.1)


def test_motion_that_goes_on_below_fifteen_hertz_is_not_noise() -> None:
    """A building that never comes to rest moves at its own frequencies, here 1 and 3 Hz."""
    rng = np.random.default_rng(3)
    time = np.arange(18000) / RATE
    samples = np.sin(2 * np.pi * time) + 0.3 * np.sin(6 * np.pi * time) + 0.01 * rng.standard_normal(18000)
    assert noise_std(samples[None], RATE) == pytest.approx([0.01], rel=0.1)


def test_noise_of_a_filtered_record_is_what_the_filter_left() -> None:
    """Band-passed 0.1-30 Hz, as the chain does before it estimates."""
    band = signal.butter(4, [0.1, 30.0], btype="bandpass", fs=RATE, output="sos")
    samples = signal.sosfiltfilt(band, np.random.default_rng(4).standard_normal((1, 18000)), axis=1)
    assert noise_std(samples, RATE) == pytest.approx(samples.std(axis=1), rel=0.1)


def test_the_density_is_that_of_the_band_the_filter_left() -> None:
    """White noise of one unit at 100 Hz has 1/50 per Hz; a filter's slope from 15 to 30 Hz takes a fifth at most."""
    samples = np.random.default_rng(5).standard_normal((2, 18000))
    band = signal.butter(4, [0.1, 30.0], btype="bandpass", fs=RATE, output="sos")
    samples[1] = signal.sosfiltfilt(band, samples[1])
    white, filtered = noise_density(samples, RATE)
    assert white == pytest.approx(0.02, rel=0.1)
    assert filtered == pytest.approx(0.018, rel=0.1)


def test_refuses_a_record_shorter_than_ten_seconds() -> None:
    with pytest.raises(RecordError, match=r"9\.99 s are too short"):
        noise_std(np.zeros((1, 999)), RATE)


def test_a_dead_channel_has_no_noise() -> None:
    assert noise_std(np.zeros((1, 1200)), RATE) == pytest.approx([0.0])
