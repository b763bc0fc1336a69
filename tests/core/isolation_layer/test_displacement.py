from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from motions import RATE, akt013, chi_chi, kobe
from sampled import Sampled, sampled

from core.arrays import Vector
from core.errors import RecordError
from core.isolation_layer.displacement import differentiate, fuse, residual_displacement
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
    found = []
    for motion in MOTIONS:
        truth: Sampled = sampled(motion)
        for seed in SEEDS:
            rng = np.random.default_rng(seed)
            displacement = noisy(truth.displacement, noise, rng)
            relative = noisy(truth.base_acceleration, noise, rng) - noisy(truth.ground_acceleration, noise, rng)
            σ = noise_std(np.array([displacement, relative]), RATE)
            fused = fuse(displacement, relative, RATE, displacement_noise=σ[0], acceleration_noise=σ[1])
            found.append(
                (
                    covered(fused.displacement, fused.displacement_std, truth.displacement),
                    covered(fused.velocity, fused.velocity_std, truth.velocity),
                )
            )
    return np.array(found)


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
    truth, found = sampled(motion), []
    for seed in SEEDS:
        displacement = noisy(truth.displacement, noise, np.random.default_rng(seed))
        moved = differentiate(displacement, RATE, displacement_noise=float(noise_std(displacement[None, :], RATE)[0]))
        assert moved is not None
        assert moved.band[0] == 0.0
        found.append(
            (
                covered(moved.displacement, moved.displacement_std, truth.displacement),
                covered(moved.velocity, moved.velocity_std, truth.velocity),
            )
        )
    # What the noise hides can only be bounded: the bands may be wider than they need to be, not narrower.
    assert (np.mean(found, axis=0) > 0.93).all()


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
    found = []
    for motion in MOTIONS:
        for scale in (1.0, 4.0):
            truth = sampled(motion, scale=scale, rest=180.0)
            for seed in SEEDS:
                displacement = truth.displacement[: round(cut * RATE)]
                measured = noisy(displacement, 0.01, np.random.default_rng(seed))
                residual = residual_displacement(measured, RATE)
                found.append(abs(residual.value - truth.displacement[-1]) < BAND * residual.std)
    assert np.mean(found) > 0.9


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
    """What the chain makes of pure noise, away from the ends that the line between them holds."""
    rng = np.random.default_rng(8)
    transducer, accelerometer = 1e-4 * rng.standard_normal(20000), 2e-3 * rng.standard_normal(20000)
    fused = fuse(transducer, accelerometer, 100.0, displacement_noise=1e-4, acceleration_noise=2e-3)
    # Some 500 independent values are left below the crossover: 3 % either way, 10 % is certain.
    assert np.std(fused.displacement[1000:-1000]) == pytest.approx(fused.noise, rel=0.1)
    assert fused.displacement_std[1000:-1000] == pytest.approx(fused.noise, rel=0.05)
