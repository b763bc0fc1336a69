"""Noise, drift, flicker and the band clear of noise."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import signal

from core.arrays import Vector
from core.errors import RecordError
from core.signals.noise import clear_band, drifting_noise, flicker_corner, noise_density, noise_std, record_flicker
from core.signals.spectra import smoothed

RATE = 100.0
COUNT = 9000
FREQUENCY: Vector = np.asarray(np.fft.rfftfreq(COUNT, 1 / RATE), dtype=float)
LINES = 0.01 * np.arange(1, 2001)


def test_white_noise_has_its_own_std() -> None:
    """A fifth of 180 s: 36 spectra of 70 lines, half overlapping, are accurate to about 3 %; three times that is
    required."""
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
    with pytest.raises(RecordError, match=r"9\.99 s is too short"):
        noise_std(np.zeros((1, 999)), RATE)


def test_a_dead_channel_has_no_noise() -> None:
    assert noise_std(np.zeros((1, 1200)), RATE) == pytest.approx([0.0])


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
    results = [record_flicker(moving(np.random.default_rng([seed, 7]), corner), RATE) for seed in range(6)]
    level = 1 + corner / 17.5  # the white level is read where some flicker is left: from 15 to 20 Hz
    assert results == pytest.approx([corner / level] * 6, rel=0.4)


def test_nothing_is_known_of_one_channel_nor_of_a_short_record() -> None:
    lines = np.fft.rfft(np.random.default_rng(1).standard_normal((2, COUNT)), axis=1)
    assert flicker_corner(lines[:1], np.ones(1), FREQUENCY) == 0.0
    few = np.asarray(np.fft.rfftfreq(1000, 1 / RATE), dtype=float)
    assert flicker_corner(lines[:, : few.size], np.ones(2), few) == 0.0


def test_the_band_of_a_known_spectrum_is_where_it_is_three_times_the_noise() -> None:
    """A signal of power f² to 1 Hz and f^-2 above, noise of 4e-4: 36e-4 is crossed at 0.06 and at 16.7 Hz."""
    power = np.minimum(LINES, 1 / LINES) ** 2
    low, high = clear_band(power, np.full(LINES.size, 4e-4), LINES) or (0.0, 0.0)
    assert low == pytest.approx(0.06, abs=0.011)
    assert high == pytest.approx(1 / 0.06, abs=0.011)


def test_a_band_ends_at_the_first_gap_and_nothing_clear_has_none() -> None:
    power = np.where((LINES > 0.5) & (LINES < 0.6), 1.0, 100.0) + 1000 * (LINES[300] == LINES)
    low, high = clear_band(power, np.ones(LINES.size), LINES) or (0.0, 0.0)
    assert (low, high) == (pytest.approx(0.6), LINES[-1])
    assert clear_band(np.ones(LINES.size), np.ones(LINES.size), LINES) is None


def test_white_and_drifting_noise_are_distinguished() -> None:
    rng = np.random.default_rng(1)
    white, drifting = (rng.chisquare(1, LINES.size) for _ in range(2))
    density = 4e-6 + 1e-8 / LINES**2
    result = drifting_noise(4e-6 * white + 1e-8 / LINES**2 * drifting, LINES, 2e-3)
    # six bins of chi-square with one degree of freedom: a factor of three either way is certain
    assert (result < 3 * density).all()
    assert (result > density / 3).all()


def test_smoothing_keeps_a_level_and_a_total() -> None:
    assert smoothed(np.full(LINES.size, 3.0), LINES) == pytest.approx(3.0)
    one = np.where(LINES[1000] == LINES, 1.0, 0.0)
    # a bin's share is spread over the half octave around it
    assert smoothed(one, LINES).sum() == pytest.approx(1.0, rel=0.01)
