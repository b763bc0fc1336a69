from dataclasses import dataclass
from functools import cache

import ground_motions
import numpy as np
import pytest

from core.arrays import Matrix, Vector
from core.building import fixed_base_modes
from core.identification.identified_modes import Identification, IdentifiedMode, identified_modes
from core.identification.modes import real_shape
from core.identification.refinement import Refinement, refined
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR

EXACT = fixed_base_modes(BUILDING)
SHAPE = EXACT.shape[FOURTH_STOREY] / EXACT.shape[-1]
MOTIONS = ("akt013", "kobe", "chi_chi")


@cache
def clean(motion: str) -> Matrix:
    """(3, 18000) m/s² of base slab, fourth storey and roof of the paper's building."""
    truth = simulate(BUILDING, ISOLATOR, getattr(ground_motions, motion)(), ground_motions.RATE)
    return np.vstack([truth.base_acceleration, truth.floor_acceleration[[FOURTH_STOREY, -1]]])


def noisy(samples: Matrix, noise: float, seed: int) -> Matrix:
    rms = np.sqrt(np.mean(samples**2, axis=1, keepdims=True))
    return np.asarray(samples + noise * rms * np.random.default_rng(seed).standard_normal(samples.shape))


def both(samples: Matrix) -> tuple[tuple[IdentifiedMode, ...], Refinement]:
    """The modes as identified, and refined."""
    modes = identified_modes(samples[0], samples[1:], ground_motions.RATE, Identification())
    return modes, refined(modes, samples[0], samples[1:], ground_motions.RATE, Identification())


@dataclass(frozen=True)
class Errors:
    """Errors of the first three modes of one record, or of as many as it has."""

    normalised: Matrix
    """(modes, 3) of frequency, damping ratio and shape at the fourth storey, in standard deviations."""
    damping: Vector
    """(2,) of the first mode's, relative, before and after."""


def errors(motion: str, noise: float, seed: int) -> Errors:
    before, after = both(noisy(clean(motion), noise, seed))
    rows = []
    for number, mode in enumerate(after.modes[:3]):
        assert mode.deviation is not None
        assert mode.shape_covariance is not None
        shape_std = np.sqrt(mode.shape_covariance[0, 0])
        rows.append(
            (
                (mode.frequency - EXACT.frequency[number]) / mode.deviation.frequency,
                (mode.damping_ratio - EXACT.damping_ratio[number]) / mode.deviation.damping_ratio,
                (real_shape(mode.shape)[0] - SHAPE[number]) / shape_std,
            )
        )
    ratios = np.array([before[0].damping_ratio, after.modes[0].damping_ratio])
    return Errors(np.array(rows), ratios / EXACT.damping_ratio[0] - 1)


@pytest.mark.accuracy
@pytest.mark.parametrize("noise", [0.01, 0.05, 0.1])
def test_standard_deviations_cover_the_truth(noise: float) -> None:
    """92 to 99 % of about 260 intervals of ± 1.96 standard deviations at each noise contain the truth.

    Two and a half deviations of 95 % below; above more, for the noise's level is an upper bound and the best mode left
    out is allowed for.
    """
    results = [errors(motion, noise, seed) for motion in MOTIONS for seed in range(10)]
    covered = np.mean(np.abs(np.vstack([one.normalised for one in results])) < 1.96)
    assert 0.92 < covered < 0.99


@pytest.mark.accuracy
def test_damping_of_the_first_mode_with_a_tenth_of_noise_on_every_channel() -> None:
    """The goal: half of the 12 % of the best of those programs that take the input as it is."""
    results = [errors(motion, 0.1, 100 + seed) for motion in MOTIONS for seed in range(10)]
    before, after = np.mean([np.abs(one.damping) for one in results], axis=0)
    assert after < 0.06
    assert after < before / 2


@pytest.mark.accuracy
@pytest.mark.parametrize("motion", MOTIONS)
def test_without_noise_the_modes_are_exact(motion: str) -> None:
    """1e-4 of what the motion determines well: the first four frequencies and the first three damping ratios."""
    _, result = both(clean(motion))
    assert [mode.frequency for mode in result.modes[:4]] == pytest.approx(EXACT.frequency[:4], rel=1e-4)
    assert [mode.damping_ratio for mode in result.modes[:3]] == pytest.approx(EXACT.damping_ratio[:3], rel=1e-4)


@pytest.mark.parametrize(("motion", "start", "stop"), [("akt013", 1500, 6500), ("kobe", 1300, 5200)])
def test_a_record_cut_out_of_the_motion(motion: str, start: int, stop: int) -> None:
    """Neither end at rest: the standard deviations still cover, three of them at 99.7 %."""
    samples = noisy(clean(motion)[:, start:stop], 0.01, seed=1)
    _, result = both(samples)
    assert result.misfit is not None
    assert result.misfit < 1.5
    for number, mode in enumerate(result.modes[:3]):
        assert mode.deviation is not None
        assert abs(mode.frequency - EXACT.frequency[number]) < 3 * mode.deviation.frequency
        assert abs(mode.damping_ratio - EXACT.damping_ratio[number]) < 3 * mode.deviation.damping_ratio


def test_where_noise_is_not_what_is_wrong_the_modes_stay_as_they_are() -> None:
    """A floor that moves by itself, as no mode of the building explains."""
    samples = noisy(clean("akt013"), 0.001, seed=2)
    time = np.arange(samples.shape[1]) / ground_motions.RATE
    samples[2] += 0.2 * samples[2].std() * np.sin(2 * np.pi * (1 + 0.01 * time) * time)
    before, after = both(samples)
    assert after.misfit is not None
    assert after.misfit > 4
    assert after.modes == before


def test_a_record_of_exact_zeros_but_for_the_motion() -> None:
    """As a simulation may give it: a noise of nothing is not divided by."""
    samples = clean("akt013").copy()
    samples[:, :1000] = 0
    samples[:, 9000:] = 0
    before, after = both(samples)
    assert after.misfit is not None
    assert np.isfinite(after.misfit)
    assert after.modes[0].frequency == pytest.approx(before[0].frequency, rel=1e-3)


def test_a_single_floor_has_a_shape_that_is_known() -> None:
    series = noisy(clean("akt013"), 0.01, seed=3)
    modes = identified_modes(series[0], series[2:], ground_motions.RATE, Identification())
    result = refined(modes, series[0], series[2:], ground_motions.RATE, Identification())
    assert result.modes[0].shape_covariance == pytest.approx(np.zeros((1, 1)))
    assert result.modes[0].frequency == pytest.approx(EXACT.frequency[0], rel=1e-3)


@pytest.mark.parametrize("noise", [0.01, 0.1])
def test_a_sensor_with_another_gain_and_a_late_clock(noise: float) -> None:
    """Two per cent and one sample at the roof: no damping of the structure is made of them."""
    _, right = both(noisy(clean("akt013"), noise, seed=4))
    samples = noisy(clean("akt013"), noise, seed=4)
    samples[2] = 1.02 * np.roll(samples[2], 1)
    _, wrong = both(samples)
    assert right.misfit is not None
    assert wrong.misfit == pytest.approx(right.misfit, rel=0.05)
    for one, other in zip(right.modes[:3], wrong.modes[:3], strict=True):
        assert one.deviation is not None
        assert abs(other.frequency - one.frequency) < 0.5 * one.deviation.frequency
        assert abs(other.damping_ratio - one.damping_ratio) < 0.5 * one.deviation.damping_ratio
