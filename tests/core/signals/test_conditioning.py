import numpy as np
import pytest
import scipy
from hypothesis import given, strategies as st

from core.errors import RecordError
from core.signals.conditioning import band_passed, resampled, without_baseline


def waves(time: np.ndarray) -> np.ndarray:
    return np.sin(2 * np.pi * 3.3 * time + 1) + 0.5 * np.cos(2 * np.pi * 11 * time)


@given(rate=st.sampled_from([50.0, 200 / 3, 100.0, 120.0, 128.0, 200.0, 250.0]), delay=st.floats(0, 0.5))
def test_a_band_limited_motion_is_the_same_at_other_instants(rate: float, delay: float) -> None:
    values = resampled(waves(np.arange(round(20 * rate)) / rate), rate, 100.0, delay)
    error = values - waves(delay + np.arange(values.size) / 100)
    # 80 dB of the filter, and the 1e-3 samples within which instants count as the same; 3 s of margin at the ends
    assert np.abs(error[300:-300]).max() < 2e-3


def test_what_the_lower_rate_cannot_show_does_not_come_back_as_an_alias() -> None:
    time = np.arange(4000) / 200
    alias = resampled(np.sin(2 * np.pi * 63 * time), 200.0, 100.0)  # would appear at 37 Hz
    assert np.abs(alias[200:-200]).max() < 2e-4  # 80 dB, and the ripple of two taps' rounding


def test_a_rate_that_is_no_fraction_is_refused() -> None:
    with pytest.raises(RecordError, match="must be a fraction of numbers up to 1000"):
        resampled(np.zeros(100), 0.0123457, 100.0)


def test_the_baseline_is_the_time_before_the_event_so_that_a_residual_offset_stays() -> None:
    samples = np.concatenate([np.full(1000, 0.5), 0.5 + waves(np.arange(3000) / 100), np.full(1000, 0.8)])
    assert without_baseline(samples, 100.0)[-1] == pytest.approx(0.3, abs=1e-12)


def test_the_band_passes_without_delay_and_stops_what_is_outside() -> None:
    time = np.arange(12000) / 100
    inside, outside = np.sin(2 * np.pi * 1.0 * time), 2.0 + np.sin(2 * np.pi * 45 * time)
    left = band_passed(inside + outside, 100.0, (0.1, 30.0))
    # the middle: at the ends the reflected offset and sine are not periodic
    assert left[3000:-3000] == pytest.approx(inside[3000:-3000], abs=2e-3)


def test_a_record_too_short_for_the_band_is_refused() -> None:
    with pytest.raises(RecordError, match="must be longer than 20 s"):
        band_passed(np.zeros(1000), 100.0, (0.1, 30.0))


@pytest.mark.parametrize("shape", [(3000,), (4, 3000)])
def test_the_band_is_passed_as_by_scipy(shape: tuple[int, ...]) -> None:
    samples = np.random.default_rng(1).standard_normal(shape) + 3.0
    sections = scipy.signal.butter(4, (0.2, 20.0), "bandpass", fs=100.0, output="sos")
    expected = scipy.signal.sosfiltfilt(sections, samples, axis=-1, padlen=1000)
    assert np.array_equal(band_passed(samples, 100.0, (0.2, 20.0)), expected)
