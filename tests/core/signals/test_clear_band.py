import numpy as np
import pytest

from core.signals.clear_band import clear_band, drifting_noise, smoothed

FREQUENCY = 0.01 * np.arange(1, 2001)


def test_the_band_of_a_known_spectrum_is_where_it_is_three_times_the_noise() -> None:
    """A signal of power f² to 1 Hz and f^-2 above, noise of 4e-4: 36e-4 is crossed at 0.06 and at 16.7 Hz."""
    signal = np.minimum(FREQUENCY, 1 / FREQUENCY) ** 2
    low, high = clear_band(signal, np.full(FREQUENCY.size, 4e-4), FREQUENCY) or (0.0, 0.0)
    assert low == pytest.approx(0.06, abs=0.011)
    assert high == pytest.approx(1 / 0.06, abs=0.011)


def test_a_band_ends_at_the_first_gap_and_nothing_clear_has_none() -> None:
    power = np.where((FREQUENCY > 0.5) & (FREQUENCY < 0.6), 1.0, 100.0) + 1000 * (FREQUENCY[300] == FREQUENCY)
    low, high = clear_band(power, np.ones(FREQUENCY.size), FREQUENCY) or (0.0, 0.0)
    assert (low, high) == (pytest.approx(0.6), FREQUENCY[-1])
    assert clear_band(np.ones(FREQUENCY.size), np.ones(FREQUENCY.size), FREQUENCY) is None


def test_white_and_drifting_noise_are_told_apart() -> None:
    rng = np.random.default_rng(1)
    white, drifting = (rng.chisquare(1, FREQUENCY.size) for _ in range(2))
    density = 4e-6 + 1e-8 / FREQUENCY**2
    found = drifting_noise(4e-6 * white + 1e-8 / FREQUENCY**2 * drifting, FREQUENCY, 2e-3)
    # six bins of chi-square with one degree of freedom: a factor of three either way is certain
    assert (found < 3 * density).all()
    assert (found > density / 3).all()


def test_smoothing_keeps_a_level_and_a_total() -> None:
    assert smoothed(np.full(FREQUENCY.size, 3.0), FREQUENCY) == pytest.approx(3.0)
    one = np.where(FREQUENCY[1000] == FREQUENCY, 1.0, 0.0)
    # a bin's share is spread over the half octave around it
    assert smoothed(one, FREQUENCY).sum() == pytest.approx(1.0, rel=0.01)
