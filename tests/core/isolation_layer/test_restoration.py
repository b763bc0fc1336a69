"""Slow motion restored to displacements that were integrated through a high-pass, against the exact motion."""

import numpy as np
import pytest
from building_models import bncs, bncs_segments
from scipy.signal import butter, sosfilt
from shared_data import needs_shared

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.isolation_layer.restoration import HighPass, high_pass_of, restored

RATE = 100.0
SECONDS = 90.0


def moved(seed: int) -> tuple[Vector, Vector]:
    """(n,) m and (n,) m/s² of a layer of 0.4 Hz that is shaken for a quarter of a minute, between rests."""
    t = np.arange(0.0, SECONDS, 1 / RATE)
    frequency = np.fft.rfftfreq(t.size, 1 / RATE)
    shaken = np.random.default_rng(seed).standard_normal(t.size) * np.exp(-(((t - 30) / 8) ** 2))
    ratio = frequency / 0.4
    lines = np.fft.rfft(shaken) / (1 - ratio**2 + 0.3j * ratio) / (1 + (frequency / 5) ** 4)
    lines *= HighPass(0.04, 4).gain(np.asarray(frequency))
    u = np.fft.irfft(lines, t.size)
    size = 0.1 / abs(u).max()
    bent = np.fft.irfft(-lines * (2 * np.pi * frequency) ** 2, t.size)
    return np.asarray(size * u), np.asarray(size * bent)


def through(high_pass: HighPass, displacement: Vector) -> Vector:
    """(n,) m, filtered without phase, the record padded by zeros."""
    count = 4 * displacement.size
    gain = high_pass.gain(np.asarray(np.fft.rfftfreq(count, 1 / RATE)))
    return np.asarray(np.fft.irfft(np.fft.rfft(displacement, count) * gain, count)[: displacement.size])


def rms(error: Vector) -> float:
    return float(np.sqrt(np.mean((error - error.mean()) ** 2)))


@pytest.mark.parametrize("corner", [0.15, 0.2, 0.25])
@pytest.mark.parametrize("power", [4, 8, 16])
def test_the_high_pass_of_an_integral_is_recognised(corner: float, power: int) -> None:
    """With noise of 0.01 m/s² in the accelerations; 5 %: there are few periods of slow motion."""
    exact, bent = moved(1)
    noise = 1e-2 * np.random.default_rng(2).standard_normal(bent.size)
    found = high_pass_of(through(HighPass(corner, power), exact), bent + noise, RATE)
    assert found is not None
    assert found.power == power
    assert found.corner == pytest.approx(corner, rel=0.05)


@pytest.mark.parametrize("seed", range(4))
def test_most_of_the_slow_motion_returns(seed: int) -> None:
    """Two fifths at least of what the channel lacks, with noise and drift of the accelerations."""
    exact, bent = moved(seed)
    rng = np.random.default_rng(seed)
    drift = 2e-3 * np.sin(2 * np.pi * 0.02 * np.arange(bent.size) / RATE)
    channel = through(HighPass(0.15, 8), exact)
    better = restored(channel, bent + drift + 5e-3 * rng.standard_normal(bent.size), RATE)
    assert better is not None
    assert rms(better.displacement - exact) < 0.6 * rms(channel - exact)
    assert rms(better.velocity - np.gradient(exact, 1 / RATE)) < 0.6 * rms(np.gradient(channel - exact, 1 / RATE))


def test_a_record_that_was_cut_does_little_harm() -> None:
    """Cut while the layer moves slowly: the channel was integrated over the whole, and knows what the file lacks."""
    exact, bent = moved(5)
    channel = through(HighPass(0.15, 8), exact)
    kept = slice(0, round(45 * RATE))
    better = restored(channel[kept], bent[kept], RATE)
    assert better is not None
    assert rms(better.displacement - exact[kept]) < 0.6 * rms(channel[kept] - exact[kept])


def test_an_unknown_filter_is_not_undone() -> None:
    """One with phase."""
    exact, bent = moved(1)
    channel = np.asarray(sosfilt(butter(3, 0.2, "highpass", fs=RATE, output="sos"), exact))
    assert high_pass_of(channel, bent, RATE) is None
    assert restored(channel, bent, RATE) is None


@needs_shared
def test_the_real_building_is_offered_its_slow_motion_and_gets_it_by_choice() -> None:
    """CNP100: integrated by the source through 0.15 Hz; the choice changes the largest displacement by millimetres."""
    as_recorded, by_choice = (
        analyse(bncs_segments("CNP100"), bncs(), AnalysisSettings(integral=way)) for way in ("recorded", "restored")
    )
    offered = [one.message for one in as_recorded.quality if "can be restored" in one.message]
    assert len(offered) == 1
    assert "high-pass of 0.15 Hz" in offered[0]
    assert any("was restored down to 0.06 Hz" in one.message for one in by_choice.quality)
    before, after = (one.directions["x"].motion for one in (as_recorded, by_choice))
    assert before is not None
    assert after is not None
    assert after.band[0] == 0.06
    assert after.is_integrated
    assert after.residual is None
    assert 0.002 < after.peak[0] - before.peak[0] < 0.01
    for one, other in zip(after.fitting_std, before.fitting_std, strict=True):
        assert one == pytest.approx(other)  # slow motion that may be wrong does not outweigh the rest in a fit
