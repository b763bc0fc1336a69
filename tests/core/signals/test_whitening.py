"""White noise becomes independent unit numbers; what lies beyond the band is gone; back is the inverse within it."""

import numpy as np
import pytest

from core.estimators.result import white
from core.signals.whitening import BAND, reweighted, shrunk, whitening

RATE, COUNT = 100.0, 6000
NOISE = np.random.default_rng(3).standard_normal(COUNT)
UNIT = white(np.ones(COUNT), BAND).at


def test_noise_that_is_white_in_the_band_has_unit_coefficients() -> None:
    """4 of their 1482 coefficients' standard errors, 1/√(2 · 1482)."""
    band = whitening(NOISE, RATE, UNIT)
    rng = np.random.default_rng(1)
    noise = np.zeros(COUNT)
    coefficients = rng.standard_normal(band.std.size)
    noise = band.back(coefficients)
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(1.0, abs=4 / np.sqrt(2 * band.std.size))
    assert band.of(noise[None])[0] == pytest.approx(coefficients, abs=1e-9)


@pytest.mark.parametrize(("frequency", "remains"), [(0.05, 0.0), (1.0, 1.0), (20.0, 0.0)])
def test_only_the_band_remains(frequency: float, remains: float) -> None:
    """1 %: a sine that fits the record's half periods is one coefficient, but for its phase."""
    time = (np.arange(COUNT) + 0.5) / RATE
    wave = np.cos(2 * np.pi * frequency * time)
    band = whitening(NOISE, RATE, UNIT)
    kept = band.back(band.of(wave[None])[0])
    assert np.linalg.norm(kept) / np.linalg.norm(wave) == pytest.approx(remains, abs=0.01)
    assert BAND[0] <= band.frequency[0] <= band.frequency[-1] <= BAND[1]


def test_weights_follow_what_is_left_over_record_by_record_but_never_fall_below_the_noise() -> None:
    bands = (whitening(NOISE, RATE, UNIT), whitening(NOISE, RATE, UNIT))
    left = (np.full(bands[0].std.size, 3.0), np.full(bands[1].std.size, 0.5))
    heavier, same = reweighted(bands, left)
    assert heavier.std == pytest.approx(3 * bands[0].std)
    assert same.std == pytest.approx(bands[1].std)


def test_a_pattern_keeps_its_size_where_a_model_leaves_more_than_noise() -> None:
    """The force of one deviation of it has the length s / √(1 + s²) in units of the noise."""
    pattern = np.sin(2 * np.pi * 0.7 * np.arange(COUNT) / RATE)[None]
    band = whitening(NOISE, RATE, UNIT, patterns=pattern)
    (grown,) = reweighted((band,), (np.full(band.std.size, 20.0),))
    (strength,) = band.strengths
    for weights, s in ((band, strength), (grown, strength / 20)):
        assert np.linalg.norm(weights.of(pattern)) == pytest.approx(s / np.sqrt(1 + s**2), rel=1e-6)
    assert grown.rms(grown.of(pattern)[0]) == pytest.approx(band.rms(band.of(pattern)[0]), rel=1e-9)


def test_noise_with_patterns_becomes_independent_and_comes_back() -> None:
    """Two patterns of 50 times the free noise; 4 standard errors of the variance of 400 draws."""
    rng = np.random.default_rng(4)
    time = np.arange(COUNT) / RATE
    patterns = 50 * np.array(
        [np.sin(2 * np.pi * 0.7 * time), np.sin(2 * np.pi * 0.7 * time + 0.3) * np.exp(-time / 20)]
    )
    band = whitening(NOISE, RATE, UNIT, patterns=patterns)
    free = whitening(NOISE, RATE, UNIT)
    drawn = np.array([free.back(rng.standard_normal(free.std.size)) for _ in range(400)])
    white = band.of(drawn + rng.standard_normal((400, 2)) @ patterns)
    assert np.var(white @ band.patterns.T, axis=0) == pytest.approx(np.ones(2), abs=4 * np.sqrt(2 / 400))
    assert np.var(white) == pytest.approx(1.0, abs=4 * np.sqrt(2 / white.size))
    assert band.of(band.back(white[0])[None])[0] == pytest.approx(white[0], abs=1e-9)


@pytest.mark.parametrize("band", [(0.5, 1.5), (2.0, 3.0), (4.0, 6.0)])
def test_a_posterior_mean_holds_the_share_of_a_force_that_it_is_reported_to(band: tuple[float, float]) -> None:
    """A force whose power falls with the fourth power of frequency, in white noise, by Wiener's filter: 0.98 of it is
    left at 1 Hz, a tenth at 5 Hz. 4 standard errors of the regression of what is estimated on what is true."""
    rng, plain = np.random.default_rng(5), whitening(NOISE, RATE, UNIT)
    power, noise = 100 / plain.frequency**4, 2.0
    true = np.sqrt(power) * rng.standard_normal(power.size)
    kept = power / (power + noise)
    estimate = kept * (true + np.sqrt(noise) * rng.standard_normal(power.size))
    history, exact = (plain.back(one / plain.std) for one in (estimate, true))
    weights = shrunk(plain, history, lambda f: np.interp(f, plain.frequency, kept * noise) * 2 / RATE)
    model = weights.filtered(exact[None])[0]
    there = (plain.frequency >= band[0]) & (plain.frequency < band[1])
    spread = np.sqrt(np.sum((kept**2 * noise * model**2)[there])) / np.sum(model[there] ** 2)
    ratio = np.sum((estimate * model)[there]) / np.sum(model[there] ** 2)
    assert ratio == pytest.approx(1.0, abs=4 * spread)
    assert model[there] != pytest.approx(true[there], rel=0.01)
