from collections.abc import Callable

import numpy as np
import pytest
from motions import RATE, akt013, chi_chi, kobe
from sampled import sampled

from core.arrays import Vector
from core.errors import RecordError
from core.isolation_layer.integration import integrate
from core.signals.noise import noise_std

SEEDS = range(4)


def drift(size: int, step: float, rng: np.random.Generator) -> np.ndarray:
    """A random walk from rest: its spectrum falls as 1/ω²."""
    walk = step * np.cumsum(rng.standard_normal(size))
    return walk - walk[:200].mean()


@pytest.mark.parametrize("wander", [0.0, 1e-5], ids=["white", "drifting"])
@pytest.mark.parametrize("noise", [1e-4, 1e-3])
@pytest.mark.parametrize("scale", [0.2, 4.0])
@pytest.mark.parametrize("motion", [akt013, kobe, chi_chi])
def test_the_integrals_standard_deviation_covers_the_truth(
    motion: Callable[[], Vector], scale: float, noise: float, wander: float
) -> None:
    """Accelerometers of 0.01 and 0.1 gal, without and with drift; measured: 92-100 % of the samples.

    What was lost below the corner can only be bounded: the bands may be wider than they need to be.
    """
    truth, shares = sampled(motion, scale), []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        above, below = (
            samples + noise * rng.standard_normal(samples.size) + drift(samples.size, wander, rng)
            for samples in (truth.base_acceleration, truth.ground_acceleration)
        )
        relative = above - below
        motion_found = integrate(relative, RATE, acceleration_noise=float(noise_std(relative[None, :], RATE)[0]))
        assert motion_found is not None
        for value, std, true in (
            (motion_found.displacement, motion_found.displacement_std, truth.displacement),
            (motion_found.velocity, motion_found.velocity_std, truth.velocity),
        ):
            shares.append(np.mean(np.abs(value - true) < 1.96 * std))
    assert np.mean(shares) > 0.93


def test_the_band_follows_the_accelerometers_noise_and_drift() -> None:
    """The same motion: the noisier the sensors, or the more they drift, the higher the corner."""
    truth, rng = sampled(akt013), np.random.default_rng(3)
    relative = truth.base_acceleration - truth.ground_acceleration
    white, walk = rng.standard_normal(relative.size), drift(relative.size, 1.0, rng)
    corners = []
    for noise, wander in ((1e-4, 0.0), (1e-3, 0.0), (1e-2, 0.0), (1e-4, 1e-5), (1e-4, 1e-4)):
        record = relative + noise * white + wander * walk
        found = integrate(record, RATE, acceleration_noise=noise)
        assert found is not None
        corners.append(found.band[0])
    quiet, usual, noisy, drifting, wandering = corners
    assert quiet < usual < noisy
    assert quiet < drifting < wandering


@pytest.mark.parametrize(("noise", "corner"), [(0.0, 0.03), (0.01, 0.11), (0.1, 0.19)])
def test_the_band_of_the_papers_building_under_akt013(noise: float, corner: float) -> None:
    """Noise of a part of each channel's root mean square; the mean of four draws, to a hundredth of a hertz."""
    truth, corners = sampled(akt013), []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        above, below = (
            samples + noise * samples.std() * rng.standard_normal(samples.size)
            for samples in (truth.base_acceleration, truth.ground_acceleration)
        )
        relative = above - below
        found = integrate(relative, RATE, acceleration_noise=float(noise_std(relative[None, :], RATE)[0]))
        assert found is not None
        corners.append(found.band[0])
    assert np.mean(corners) == pytest.approx(corner, abs=0.01)


def test_nothing_is_claimed_below_the_band() -> None:
    """A residual offset is lost: the result has none, and its band says from where on it is good."""
    time = np.arange(12000) / 100
    displacement = 0.02 * np.exp(-(((time - 40) / 8) ** 2)) * np.sin(np.pi * time) + 0.01 * (time > 40)
    step = 0.005 * (1 + np.tanh((time - 40) / 3))
    relative = np.gradient(np.gradient(displacement - 0.01 * (time > 40) + step, 0.01), 0.01)
    noise = 1e-3 * np.random.default_rng(4).standard_normal(time.size)
    found = integrate(relative + noise, 100.0, acceleration_noise=1e-3)
    assert found is not None
    assert found.residual is None
    assert found.band[0] > 0.05
    assert abs(found.displacement[-1000:].mean()) < 0.001


def test_integration_of_a_smooth_pulse_is_exact() -> None:
    time = np.arange(12000) / 100
    pulse, rate = np.exp(-(((time - 60) / 8) ** 2)), 2 * np.pi * 0.5
    displacement = pulse * np.sin(rate * (time - 60))
    slope = -2 * (time - 60) / 64 * pulse
    curvature = (-2 / 64 + (2 * (time - 60) / 64) ** 2) * pulse
    sine, cosine = np.sin(rate * (time - 60)), np.cos(rate * (time - 60))
    acceleration = curvature * sine + 2 * slope * rate * cosine - displacement * rate**2
    motion = integrate(acceleration, 100.0, acceleration_noise=1e-6)
    assert motion is not None
    assert motion.band[0] < 0.5
    # (corner/0.5)⁸ of the high-pass at 0.5 Hz, and somewhat more on the pulse's lower flank
    assert np.abs(motion.displacement - displacement).max() < 0.05
    assert np.abs(motion.displacement - displacement).max() < 4 * motion.displacement_std.max()


def test_the_noise_of_the_displacement_is_known() -> None:
    """Of noise around one pulse at 1 Hz, whose integral is exact."""
    rng, time = np.random.default_rng(8), np.arange(20000) / 100
    pulse = np.exp(-(((time - 100) / 4) ** 2)) * np.sin(2 * np.pi * (time - 100))
    clean = integrate(pulse, 100.0, acceleration_noise=2e-3)
    found = integrate(pulse + 2e-3 * rng.standard_normal(time.size), 100.0, acceleration_noise=2e-3)
    assert clean is not None
    assert found is not None
    quiet = np.r_[1000:8000, 12000:19000]
    # Nearly all of it lies at the corner, where it is clear of the noise: some hundred independent values.
    assert np.std(found.displacement[quiet]) == pytest.approx(found.noise, rel=0.3)


def test_noise_alone_is_no_motion_and_gaps_are_refused() -> None:
    noise = 1e-3 * np.random.default_rng(5).standard_normal(6000)
    assert integrate(noise, 100.0, acceleration_noise=1e-3) is None
    with pytest.raises(RecordError, match="mend or cut"):
        integrate(np.full(100, np.nan), 100.0, acceleration_noise=0.0)
