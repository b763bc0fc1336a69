"""The spectrum of an estimate's error has the error's variance, and lies where the error lies."""

import numpy as np
import pytest

from core.estimators.error_spectrum import of_fused_displacement, white
from core.isolation_layer.fusion import fuse

RATE, COUNT = 100.0, 18000


def test_a_white_error_has_its_variance_within_the_band() -> None:
    error = white(np.full(10, 3.0), (0.2, 10.2))
    frequency = np.linspace(0.2, 10.2, 50)
    assert np.trapezoid(error.at(frequency), frequency) == pytest.approx(9.0)


@pytest.mark.parametrize(("transducer", "accelerometer"), [(1e-5, 1e-3), (1e-4, 1e-3), (1e-5, 1e-2)])
def test_a_fused_displacement_errs_where_it_is_said_to(transducer: float, accelerometer: float) -> None:
    """Four standard errors of a periodogram's mean over an octave: half of its lines are free under the window."""
    rng, time = np.random.default_rng(1), np.arange(COUNT) / RATE
    ω = 2 * np.pi * 0.4
    exact = 0.05 * np.sin(ω * time) * np.sin(np.pi * time / time[-1]) ** 2
    acceleration = np.gradient(np.gradient(exact, time), time)
    found = fuse(
        exact + transducer * rng.standard_normal(COUNT),
        acceleration + accelerometer * rng.standard_normal(COUNT),
        RATE,
        displacement_noise=transducer,
        acceleration_noise=accelerometer,
    )
    said = of_fused_displacement(float(np.median(found.displacement_std)), float(np.median(found.velocity_std)))
    power = np.abs(np.fft.rfft((found.displacement - exact) * np.hanning(COUNT))) ** 2
    frequency = np.fft.rfftfreq(COUNT, 1 / RATE)
    density = 2 * power / RATE / np.sum(np.hanning(COUNT) ** 2)
    for low in (0.2, 0.4, 0.8, 1.6):
        there = (frequency >= low) & (frequency < 2 * low)
        ratio = np.mean(density[there]) / np.mean(said.at(frequency[there]))
        assert ratio == pytest.approx(1.0, abs=4 / np.sqrt(there.sum() / 2))
