"""The tangent that a record shows is the law's own, whatever the law."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, RATE, motion, observations

from core.arrays import Vector
from core.estimators.result import fused_displacement_error
from core.fitting.noise import force_noise
from core.fitting.observation import LayerHistory, Observation
from core.fitting.tangent import slip
from core.model.force_response import force_history
from core.model.isolator import Conditions, Isolator

STD, CORNER = 1e-4, 1.0
"""m and Hz, of the displacement's error."""
LINEAR = Isolator({name: BOUC_WEN.effects[name] for name in ("elastic", "viscous")})
HARD = Isolator({**LINEAR.effects, "hardening": {"k3": 5e10, "k5": 0.0}})


def error(count: int, rng: np.random.Generator) -> tuple[Vector, Vector]:
    """(count,) m and m/s, of a displacement that is fused from a transducer and accelerometers."""
    frequency = np.fft.rfftfreq(count, 1 / RATE)
    density = fused_displacement_error(STD, STD * 2 * np.pi * CORNER).at(frequency)
    lines = np.fft.rfft(rng.standard_normal(count)) * np.sqrt(density * RATE / 2)
    moved, speed = (np.fft.irfft(one, count) for one in (lines, 2j * np.pi * frequency * lines))
    return np.asarray(moved), np.asarray(speed)


def strong_then_weak(rng: np.random.Generator) -> tuple[Vector, Vector]:
    """m and m/s, cycles up to 80 mm and then, as long, up to 2 mm."""
    parts = [motion(peak, rng) for peak in (0.08, 0.002)]
    return np.concatenate([u for u, _ in parts]), np.concatenate([v for _, v in parts])


def seen_with(law: Isolator, exact: tuple[Vector, Vector], errors: tuple[Vector, Vector]) -> Observation:
    """The law's force with noise of 0.2 %, and the motion with its errors."""
    force, count = force_history(law, *exact, RATE), exact[0].size
    std = 0.002 * float(np.sqrt(np.mean(force**2)))
    (one,) = observations(law, 0.0, 1, peaks=(0.01,))
    layer = LayerHistory(
        displacement=exact[0] + errors[0],
        velocity=exact[1] + errors[1],
        force=force + std * np.random.default_rng(1).standard_normal(count),
        force_std=np.full(count, std),
        displacement_std=np.full(count, STD),
        velocity_std=np.full(count, STD * 2 * np.pi * CORNER),
    )
    return replace(one, layer=layer, conditions=Conditions.usual(count, RATE))


@pytest.mark.parametrize("law", [LINEAR, HARD, BOUC_WEN], ids=["linear", "hardening", "bouc_wen"])
def test_the_noise_by_the_motion_is_what_its_error_does_to_the_law(law: Isolator) -> None:
    """Within 8 %, over three errors. The slope of the whole loop would give two thirds of it for the layer
    that yields, whose weak cycles are twice as stiff, and a fifth too much for the one that hardens."""
    rng = np.random.default_rng(3)
    exact, ratios = strong_then_weak(rng), []
    for _ in range(3):
        seen = seen_with(law, exact, error(exact[0].size, rng))
        weights, layer = force_noise(seen).whitening, seen.layer
        driven = force_history(law, layer.displacement, layer.velocity, RATE) - force_history(law, *exact, RATE)
        made = np.linalg.norm(weights.filtered(driven[None])) / np.sqrt(weights.count)
        alone = force_noise(replace(seen, layer=replace(layer, displacement_std=None)))
        ratios.append(np.sqrt(force_noise(seen).rms ** 2 - alone.rms**2) / made)
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1.0, abs=0.08)


def test_a_spring_slips_at_its_length_and_counts_from_there() -> None:
    deflection, since = slip(np.array([0.0, 1.0, 3.0, 4.0, 3.5, 1.0, -2.0]), 2.0)
    assert deflection.tolist() == [0.0, 1.0, 2.0, 2.0, 1.5, -1.0, -2.0]
    assert since.tolist() == [0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0]
