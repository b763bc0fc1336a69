from dataclasses import replace
from functools import cache

import motions
import numpy as np
import pytest

from core.arrays import Matrix
from core.building import fixed_base_modes
from core.errors import IdentificationError
from core.identification.identified_modes import Identification, identified_modes
from core.identification.subspace import WEIGHTINGS
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR

EXACT = fixed_base_modes(BUILDING)


@cache
def clean() -> Matrix:
    """(8, 18000) m/s² of base slab and every floor of the paper's building under AKT013."""
    truth = simulate(BUILDING, ISOLATOR, motions.akt013(), motions.RATE)
    return np.vstack([truth.base_acceleration, truth.floor_acceleration])


def record(rng: np.random.Generator, rows: list[int]) -> Matrix:
    """Of these levels, 0 the base slab, with 1 % of noise on each."""
    chosen = clean()[rows]
    return chosen + 0.01 * np.sqrt(np.mean(chosen**2, axis=1, keepdims=True)) * rng.standard_normal(chosen.shape)


@pytest.mark.parametrize("weighting", sorted(WEIGHTINGS))
def test_every_weighting_finds_the_first_modes(weighting: str) -> None:
    """The project's goal at 1 % of noise on all channels: 0.2 % and 5 %."""
    channels = record(np.random.default_rng(1), [0, FOURTH_STOREY + 1, 7])
    choices = Identification(weighting=WEIGHTINGS[weighting])
    modes = identified_modes(channels[0], channels[1:], motions.RATE, choices)[:2]
    assert [mode.frequency for mode in modes] == pytest.approx(EXACT.frequency[:2], rel=0.002)
    assert [mode.damping_ratio for mode in modes] == pytest.approx(EXACT.damping_ratio[:2], rel=0.05)


def test_channels_may_have_any_scale() -> None:
    """Shapes come back in the record's units; nothing else changes."""
    channels = record(np.random.default_rng(2), [0, 3, 7])
    plain = identified_modes(channels[0], channels[1:], motions.RATE, Identification())
    scaled = identified_modes(1e-3 * channels[0], np.diag([50.0, 2.0]) @ channels[1:], motions.RATE, Identification())
    assert [mode.frequency for mode in scaled] == pytest.approx([mode.frequency for mode in plain])
    for one, other in zip(plain, scaled, strict=True):
        assert other.shape[0] / other.shape[1] == pytest.approx(25 * one.shape[0] / one.shape[1])


@pytest.mark.parametrize("levels", [[7], [3, 7], [1, 2, 3, 4, 5, 6, 7]])
def test_the_true_modes_are_reported_and_hardly_any_other(levels: list[int]) -> None:
    """The first three always; what lies within 5 % of a true frequency is that mode, all else at most one."""
    for seed in range(3):
        channels = record(np.random.default_rng(seed), [0, *levels])
        found = np.array([m.frequency for m in identified_modes(channels[0], channels[1:], 100.0, Identification())])
        nearest = np.abs(found[:, None] / EXACT.frequency - 1)
        assert found[:3] == pytest.approx(EXACT.frequency[:3], rel=0.002)
        assert np.sum(nearest.min(axis=1) > 0.05) <= 1


def test_white_noise_has_no_modes() -> None:
    """Of ten records of pure noise at most one is taken for a structure: measured, 1 in 60 at twelve seconds."""
    taken = 0
    for seed in range(10):
        noise = np.random.default_rng(seed).standard_normal((3, 1200))
        try:
            identified_modes(noise[0], noise[1:], 100.0, Identification())
            taken += 1
        except IdentificationError as refusal:
            assert "longer or stronger record" in str(refusal)  # noqa: PT017  it may also succeed
    assert taken <= 1


def test_refuses_a_dead_channel_and_says_what_would_do() -> None:
    channels = record(np.random.default_rng(3), [0, 3, 7])
    with pytest.raises(IdentificationError, match="a channel does not move"):
        identified_modes(channels[0], 0 * channels[1:], 100.0, Identification())
    with pytest.raises(IdentificationError, match="fewer block rows, would do"):
        identified_modes(channels[0, :500], channels[1:, :500], 100.0, replace(Identification(), block_rows=40))
