import numpy as np
import pytest
from motions import RATE, akt013, chi_chi, kobe

from core.displacement import fuse, integrate
from core.errors import RecordError
from core.noise import noise_std
from core.paper import BUILDING, ISOLATOR
from core.simulation import simulate


def noisy(samples: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
    return samples + noise * samples.std() * rng.standard_normal(samples.size)


@pytest.mark.parametrize("motion", [akt013, kobe, chi_chi])
def test_velocity_of_the_papers_building_at_one_percent_noise(motion) -> None:  # noqa: ANN001
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


def test_a_residual_offset_is_the_transducers() -> None:
    time = np.arange(6000) / 100
    envelope = np.exp(-(((time - 20) / 6) ** 2))
    displacement = 0.02 * envelope * np.sin(2 * np.pi * 0.5 * time) + 0.003 * (1 + np.tanh((time - 20) / 4)) / 2
    relative = np.gradient(np.gradient(displacement, 0.01), 0.01)
    fused = fuse(displacement, relative, 100.0, displacement_noise=1e-5, acceleration_noise=1e-3)
    assert fused.displacement[-100:].mean() == pytest.approx(0.003, rel=1e-3)


def test_integration_of_a_smooth_pulse_is_exact() -> None:
    time = np.arange(12000) / 100
    pulse, rate = np.exp(-(((time - 60) / 8) ** 2)), 2 * np.pi * 0.5
    displacement = pulse * np.sin(rate * (time - 60))
    slope = -2 * (time - 60) / 64 * pulse
    curvature = (-2 / 64 + (2 * (time - 60) / 64) ** 2) * pulse
    sine, cosine = np.sin(rate * (time - 60)), np.cos(rate * (time - 60))
    acceleration = curvature * sine + 2 * slope * rate * cosine - displacement * rate**2
    motion = integrate(acceleration, 100.0, 0.1, acceleration_noise=0.0)
    # (0.1/0.5)⁸ of the high-pass at 0.5 Hz, and somewhat more on the pulse's lower flank
    assert motion.displacement == pytest.approx(displacement, abs=1e-4)
    assert motion.velocity == pytest.approx(slope * sine + pulse * rate * cosine, abs=4e-4)


def test_gaps_are_refused() -> None:
    gap = np.full(100, np.nan)
    with pytest.raises(RecordError, match="mend or cut"):
        fuse(gap, np.zeros(100), 100.0, displacement_noise=1.0, acceleration_noise=1.0)
    with pytest.raises(RecordError, match="mend or cut"):
        integrate(gap, 100.0, 0.1, acceleration_noise=0.0)
    with pytest.raises(RecordError, match="one time base"):
        fuse(np.zeros(99), np.zeros(100), 100.0, displacement_noise=1.0, acceleration_noise=1.0)


def test_the_noise_of_the_displacement_is_known() -> None:
    """What the chain makes of pure noise, away from the ends that the line between them holds."""
    rng = np.random.default_rng(8)
    transducer, accelerometer = 1e-4 * rng.standard_normal(20000), 2e-3 * rng.standard_normal(20000)
    fused = fuse(transducer, accelerometer, 100.0, displacement_noise=1e-4, acceleration_noise=2e-3)
    # Some 500 independent values are left below the crossover: 3 % either way, 10 % is certain.
    assert np.std(fused.displacement[1000:-1000]) == pytest.approx(fused.noise, rel=0.1)
    integrated = integrate(accelerometer, 100.0, 0.1, acceleration_noise=2e-3)
    # Nearly all of it lies at 0.1 Hz: some 20 independent values.
    assert np.std(integrated.displacement[1000:-1000]) == pytest.approx(integrated.noise, rel=0.5)
