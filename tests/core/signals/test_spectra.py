import numpy as np
import pytest

from core.signals.spectra import hann_spectra, second_derivative

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
