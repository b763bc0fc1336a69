from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from ground_motions import RATE, akt013, chi_chi, kobe
from sampled_response import SampledResponse, sampled_response

from core.arrays import Vector
from core.errors import RecordError
from core.isolation_layer.fusion import differentiate, fuse, integrate, residual_displacement
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from core.signals.noise import noise_std

MOTIONS = (akt013, kobe, chi_chi)
SEEDS = range(6)
BAND = 1.96
"""Standard deviations of a 95 % band."""


def noisy(samples: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
    return samples + noise * samples.std() * rng.standard_normal(samples.size)


def covered(estimate: np.ndarray, std: np.ndarray, truth: np.ndarray) -> float:
    """Share of the samples within the 95 % band."""
    return float(np.mean(np.abs(estimate - truth) < BAND * std))


@pytest.mark.parametrize("motion", MOTIONS)
def test_velocity_of_the_papers_building_at_one_percent_noise(motion: Callable[[], Vector]) -> None:
    """The reference prototype reached an rms error of 0.2-0.4 %."""
    rng = np.random.default_rng(1)
    ground = motion()
    moved = simulate(BUILDING, ISOLATOR, ground, RATE)
    displacement = noisy(moved.isolator_displacement, 0.01, rng)
    relative = noisy(moved.base_acceleration, 0.01, rng) - noisy(ground, 0.01, rng)
    noise = noise_std(np.array([displacement, relative]), RATE)
    fused = fuse(displacement, relative, RATE, displacement_noise=noise[0], acceleration_noise=noise[1])
    error = np.std(fused.velocity - moved.isolator_velocity) / np.std(moved.isolator_velocity)
    assert error < 0.004


@cache
def coverages(noise: float) -> np.ndarray:
    """(motions × seeds, 2) share of displacement and velocity within the 95 % bands of the fusion."""
    results = []
    for motion in MOTIONS:
        truth: SampledResponse = sampled_response(motion)
        for seed in SEEDS:
            rng = np.random.default_rng(seed)
            displacement = noisy(truth.displacement, noise, rng)
            relative = noisy(truth.base_acceleration, noise, rng) - noisy(truth.ground_acceleration, noise, rng)
            σ = noise_std(np.array([displacement, relative]), RATE)
            fused = fuse(displacement, relative, RATE, displacement_noise=σ[0], acceleration_noise=σ[1])
            results.append(
                (
                    covered(fused.displacement, fused.displacement_std, truth.displacement),
                    covered(fused.velocity, fused.velocity_std, truth.velocity),
                )
            )
    return np.array(results)


@pytest.mark.parametrize("noise", [0.01, 0.05, 0.1])
def test_the_fusions_standard_deviation_covers_the_truth(noise: float) -> None:
    """Measured: 94.1-94.2 % of the displacement's and the velocity's samples, each motion within 93-95.5 %."""
    assert coverages(noise).mean(axis=0) == pytest.approx(0.95, abs=0.02)
    by_motion = coverages(noise).reshape(len(MOTIONS), -1, 2).mean(axis=1)
    assert by_motion == pytest.approx(0.95, abs=0.02)


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_transducer_alone_gives_a_displacement_and_a_velocity_that_cover_the_truth(
    motion: Callable[[], Vector], noise: float
) -> None:
    truth, results = sampled_response(motion), []
    for seed in SEEDS:
        displacement = noisy(truth.displacement, noise, np.random.default_rng(seed))
        moved = differentiate(displacement, RATE, displacement_noise=float(noise_std(displacement[None, :], RATE)[0]))
        assert moved is not None
        assert moved.band[0] == 0.0
        results.append(
            (
                covered(moved.displacement, moved.displacement_std, truth.displacement),
                covered(moved.velocity, moved.velocity_std, truth.velocity),
            )
        )
    # What the noise hides can only be bounded: the bands may be wider than they need to be, not narrower.
    assert (np.mean(results, axis=0) > 0.93).all()


def test_a_residual_offset_is_the_transducers() -> None:
    time = np.arange(6000) / 100
    envelope = np.exp(-(((time - 20) / 6) ** 2))
    displacement = 0.02 * envelope * np.sin(2 * np.pi * 0.5 * time) + 0.003 * (1 + np.tanh((time - 20) / 4)) / 2
    relative = np.gradient(np.gradient(displacement, 0.01), 0.01)
    fused = fuse(displacement, relative, 100.0, displacement_noise=1e-5, acceleration_noise=1e-3)
    assert fused.displacement[-100:].mean() == pytest.approx(0.003, rel=1e-3)
    assert fused.residual is not None
    assert fused.residual.value == pytest.approx(0.003, rel=1e-3)
    alone = differentiate(displacement, 100.0, displacement_noise=1e-5)
    assert alone is not None
    assert alone.displacement[-100:].mean() == pytest.approx(0.003, rel=1e-3)


@pytest.mark.parametrize("cut", [180.0, 60.0, 40.0])
def test_the_residual_displacements_standard_deviation_covers_where_the_layer_comes_to_rest(cut: float) -> None:
    """Cut in motion too, against the position after three more minutes at rest: of 36 no more than one in ten off."""
    results = []
    for motion in MOTIONS:
        for scale in (1.0, 4.0):
            truth = sampled_response(motion, scale=scale, rest=180.0)
            for seed in SEEDS:
                displacement = truth.displacement[: round(cut * RATE)]
                measured = noisy(displacement, 0.01, np.random.default_rng(seed))
                residual = residual_displacement(measured, RATE)
                results.append(abs(residual.value - truth.displacement[-1]) < BAND * residual.std)
    assert np.mean(results) > 0.9


def test_gaps_are_refused() -> None:
    gap = np.full(100, np.nan)
    with pytest.raises(RecordError, match="mend or cut"):
        fuse(gap, np.zeros(100), 100.0, displacement_noise=1.0, acceleration_noise=1.0)
    with pytest.raises(RecordError, match="mend or cut"):
        differentiate(gap, 100.0, displacement_noise=1.0)
    with pytest.raises(RecordError, match="one time base"):
        fuse(np.zeros(99), np.zeros(100), 100.0, displacement_noise=1.0, acceleration_noise=1.0)


def test_noise_alone_is_no_motion() -> None:
    noise = 1e-4 * np.random.default_rng(2).standard_normal(6000)
    assert differentiate(noise, 100.0, displacement_noise=1e-4) is None


def test_the_noise_of_the_displacement_is_known() -> None:
    """Pure noise after the chain, away from the ends that the line between them fixes."""
    rng = np.random.default_rng(8)
    transducer, accelerometer = 1e-4 * rng.standard_normal(20000), 2e-3 * rng.standard_normal(20000)
    fused = fuse(transducer, accelerometer, 100.0, displacement_noise=1e-4, acceleration_noise=2e-3)
    # Some 500 independent values are left below the crossover: 3 % either way, 10 % is certain.
    assert np.std(fused.displacement[1000:-1000]) == pytest.approx(fused.noise, rel=0.1)
    assert fused.displacement_std[1000:-1000] == pytest.approx(fused.noise, rel=0.05)


DRAWS = range(4)


def drift(size: int, step: float, rng: np.random.Generator) -> np.ndarray:
    """A random walk from rest: its spectrum falls as 1/ω²."""
    walk = step * np.cumsum(rng.standard_normal(size))
    return walk - walk[:200].mean()


@pytest.mark.accuracy
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
    truth, shares = sampled_response(motion, scale), []
    for seed in DRAWS:
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
    truth, rng = sampled_response(akt013), np.random.default_rng(3)
    relative = truth.base_acceleration - truth.ground_acceleration
    white, walk = rng.standard_normal(relative.size), drift(relative.size, 1.0, rng)
    corners = []
    for noise, wander in ((1e-4, 0.0), (1e-3, 0.0), (1e-2, 0.0), (1e-4, 1e-5), (1e-4, 1e-4)):
        record = relative + noise * white + wander * walk
        motion = integrate(record, RATE, acceleration_noise=noise)
        assert motion is not None
        corners.append(motion.band[0])
    quiet, usual, noisy, drifting, wandering = corners
    assert quiet < usual < noisy
    assert quiet < drifting < wandering


@pytest.mark.parametrize(("noise", "corner"), [(0.0, 0.03), (0.01, 0.11), (0.1, 0.19)])
def test_the_band_of_the_papers_building_under_akt013(noise: float, corner: float) -> None:
    """Noise of a part of each channel's root mean square; the mean of four draws, to a hundredth of a hertz."""
    truth, corners = sampled_response(akt013), []
    for seed in DRAWS:
        rng = np.random.default_rng(seed)
        above, below = (
            samples + noise * samples.std() * rng.standard_normal(samples.size)
            for samples in (truth.base_acceleration, truth.ground_acceleration)
        )
        relative = above - below
        motion = integrate(relative, RATE, acceleration_noise=float(noise_std(relative[None, :], RATE)[0]))
        assert motion is not None
        corners.append(motion.band[0])
    assert np.mean(corners) == pytest.approx(corner, abs=0.01)


def test_nothing_is_claimed_below_the_band() -> None:
    """A residual offset is lost: the result has none, and its band says from where on it is good."""
    time = np.arange(12000) / 100
    displacement = 0.02 * np.exp(-(((time - 40) / 8) ** 2)) * np.sin(np.pi * time) + 0.01 * (time > 40)
    step = 0.005 * (1 + np.tanh((time - 40) / 3))
    relative = np.gradient(np.gradient(displacement - 0.01 * (time > 40) + step, 0.01), 0.01)
    noise = 1e-3 * np.random.default_rng(4).standard_normal(time.size)
    motion = integrate(relative + noise, 100.0, acceleration_noise=1e-3)
    assert motion is not None
    assert motion.residual is None
    assert motion.band[0] > 0.05
    assert abs(motion.displacement[-1000:].mean()) < 0.001


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


def test_the_noise_of_the_integral_is_known() -> None:
    """Noise around one pulse at 1 Hz, whose integral is exact."""
    rng, time = np.random.default_rng(8), np.arange(20000) / 100
    pulse = np.exp(-(((time - 100) / 4) ** 2)) * np.sin(2 * np.pi * (time - 100))
    clean = integrate(pulse, 100.0, acceleration_noise=2e-3)
    motion = integrate(pulse + 2e-3 * rng.standard_normal(time.size), 100.0, acceleration_noise=2e-3)
    assert clean is not None
    assert motion is not None
    quiet = np.r_[1000:8000, 12000:19000]
    # Nearly all of it lies at the corner, where it is clear of the noise: some hundred independent values.
    assert np.std(motion.displacement[quiet]) == pytest.approx(motion.noise, rel=0.3)


def test_noise_alone_has_no_integral_and_gaps_are_refused() -> None:
    noise = 1e-3 * np.random.default_rng(5).standard_normal(6000)
    assert integrate(noise, 100.0, acceleration_noise=1e-3) is None
    with pytest.raises(RecordError, match="mend or cut"):
        integrate(np.full(100, np.nan), 100.0, acceleration_noise=0.0)
