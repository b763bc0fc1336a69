import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.signals.spectra import (
    falling_line,
    hann_spectra,
    second_derivative,
    sine_coefficients,
    sine_frequencies,
    sine_power,
    sine_variances,
    sum_with_line,
)

RATE = 100.0


def test_white_noise_has_the_windows_power_in_every_line() -> None:
    """The mean of some 12,000 squares, of which neighbours are correlated, is good to 2 %; 6 % is certain."""
    spectra = hann_spectra(np.random.default_rng(1).standard_normal((4, 6000)), RATE)
    assert np.mean(np.abs(spectra.values[:, 1:-1]) ** 2) == pytest.approx(spectra.window_power, rel=0.06)


def test_a_band_includes_both_ends() -> None:
    spectra = hann_spectra(np.zeros((1, 800)), RATE, (0.25, 0.5))
    assert spectra.frequency == pytest.approx([0.25, 0.375, 0.5])


def test_the_second_derivative_of_a_slow_sine() -> None:
    """Central differences twice: (sin ωh / ωh)² = 0.9987 at 1 Hz and 100 Hz; the two samples at each end differ."""
    time = np.arange(1000) / RATE
    sine = np.sin(2 * np.pi * time)
    bend = second_derivative(sine, RATE)
    assert bend[2:-2] == pytest.approx(-0.998684 * (2 * np.pi) ** 2 * sine[2:-2], abs=1e-3)


@given(size=st.integers(5, 60))
def test_the_coefficients_of_a_line_are_known(size: int) -> None:
    line = np.linspace(1.0, 0.0, size)
    assert falling_line(size) == pytest.approx(sine_coefficients(line), abs=1e-9)


@given(size=st.integers(5, 60))
def test_series_and_line_give_the_samples_back_and_their_derivative(size: int) -> None:
    """A sine that vanishes at both ends, and a line."""
    time = np.arange(size) / 10.0
    rate = np.pi / time[-1]
    line = 2.0 + 0.3 * time
    values, derivative = sum_with_line(sine_coefficients(np.sin(rate * time)), line, 10.0)
    assert values == pytest.approx(np.sin(rate * time) + line)
    assert derivative == pytest.approx(rate * np.cos(rate * time) + 0.3)


@pytest.mark.parametrize("size", [40, 41])
def test_variances_are_those_of_a_sum_of_independent_sines(size: int) -> None:
    """Against the sum written out, for an even and an odd number of samples."""
    rng = np.random.default_rng(size)
    density, ω = rng.random(size - 2), sine_frequencies(size, 10.0)
    k, i = np.arange(1, size - 1)[:, None], np.arange(size)[None, :]
    sines, cosines = (trig(np.pi * k * i / (size - 1)) for trig in (np.sin, np.cos))
    series, derivative = sine_variances(density, ω)
    assert series == pytest.approx(2 / (size - 1) * density @ sines**2)
    assert derivative == pytest.approx(2 / (size - 1) * (density * ω**2) @ cosines**2)


def test_white_noise_has_its_variance_in_every_term() -> None:
    noise = np.random.default_rng(1).standard_normal(20000)
    power = sine_power(sine_coefficients(noise))
    # the mean of 20,000 squares is right to 1 %
    assert power.mean() == pytest.approx(1.0, abs=0.03)
