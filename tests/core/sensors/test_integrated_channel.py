"""A displacement channel that is the accelerations, integrated twice, beside one that is a measurement."""

import numpy as np
import pytest
from described import bncs, bncs_segments
from motions import RATE, kobe
from real_building import TESTS
from sampled import sampled
from scipy.signal import butter, sosfiltfilt
from shared import needs_shared

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.sensors.integrated_channel import is_integral


def measured(seed: int, transducer: float, accelerometer: float) -> tuple[Vector, Vector]:
    """m and m/s², with white noise of these standard deviations."""
    moved, rng = sampled(kobe), np.random.default_rng(seed)
    relative = moved.base_acceleration - moved.ground_acceleration
    noise = rng.standard_normal((2, relative.size)) * [[transducer], [accelerometer]]
    return moved.displacement + noise[0], relative + noise[1]


def integral(relative: Vector, lowest: float) -> Vector:
    """Twice, above a frequency."""
    ω = 2 * np.pi * np.fft.rfftfreq(relative.size, 1 / RATE)
    lines = np.fft.rfft(relative)
    lines[1:] /= -(ω[1:] ** 2)
    lines[0] = 0.0
    raw = np.fft.irfft(lines, relative.size)
    return np.asarray(sosfiltfilt(butter(4, lowest, "highpass", fs=RATE, output="sos"), raw))


@pytest.mark.parametrize("accelerometer", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("transducer", [2e-6, 2e-5, 1e-3])
def test_a_transducer_is_a_measurement(transducer: float, accelerometer: float) -> None:
    assert not is_integral(*measured(3, transducer, accelerometer), RATE)


def test_a_transducer_is_one_without_noise() -> None:
    assert not is_integral(*measured(3, 0.0, 0.0), RATE)


def test_a_transducer_is_one_through_an_anti_alias_filter() -> None:
    """Which takes away the noise that would give it away."""
    displacement, relative = measured(3, 2e-5, 1e-3)
    filtered = sosfiltfilt(butter(8, 10.0, fs=RATE, output="sos"), displacement)
    assert not is_integral(np.asarray(filtered), relative, RATE)


@pytest.mark.parametrize("lowest", [0.1, 0.15, 0.3])
@pytest.mark.parametrize("accelerometer", [1e-3, 1e-2])
def test_an_integral_is_none(lowest: float, accelerometer: float) -> None:
    _, relative = measured(4, 0.0, accelerometer)
    assert is_integral(integral(relative, lowest), relative, RATE)


@needs_shared
@pytest.mark.parametrize("test", TESTS)
def test_the_real_building_has_no_transducer(test: str) -> None:
    """Its displacement was integrated by whoever published it; the analysis says so, and how well it knows it."""
    found = analyse(bncs_segments(test), bncs(), AnalysisSettings(estimator="cms"))
    motion = found.directions["x"].motion
    assert motion is not None
    assert motion.is_integrated
    assert motion.residual is None
    assert motion.peak[1] > 5e-4
    said = [finding.message for finding in found.quality if finding.kind == "displacement"]
    assert any("integrated twice" in message for message in said)
