from dataclasses import replace
from functools import cache

import ground_motions
import numpy as np
import pytest
from scipy import signal

from core.arrays import Matrix
from core.building import fixed_base_modes
from core.errors import IdentificationError
from core.identification.identified_modes import Identification, identified_modes, is_supported, misfit_increase
from core.identification.modal_uncertainty import ModalDeviation
from core.identification.subspace import WEIGHTINGS
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR

EXACT = fixed_base_modes(BUILDING)
SLOW, FAST = 0.98 * np.exp(0.3j), 0.95 * np.exp(1.2j)


@cache
def clean() -> Matrix:
    """(8, 18000) m/s² of base slab and every floor of the paper's building under AKT013."""
    truth = simulate(BUILDING, ISOLATOR, ground_motions.akt013(), ground_motions.RATE)
    return np.vstack([truth.base_acceleration, truth.floor_acceleration])


def record(rng: np.random.Generator, rows: list[int]) -> Matrix:
    """Record of these levels, 0 being the base slab, with 1 % of noise on each."""
    chosen = clean()[rows]
    return chosen + 0.01 * np.sqrt(np.mean(chosen**2, axis=1, keepdims=True)) * rng.standard_normal(chosen.shape)


@pytest.mark.parametrize("weighting", sorted(WEIGHTINGS))
def test_every_weighting_finds_the_first_modes(weighting: str) -> None:
    """The project's goal at 1 % of noise on all channels: 0.2 % and 5 %."""
    channels = record(np.random.default_rng(1), [0, FOURTH_STOREY + 1, 7])
    choices = Identification(weighting=WEIGHTINGS[weighting])
    modes = identified_modes(channels[0], channels[1:], ground_motions.RATE, choices)[:2]
    assert [mode.frequency for mode in modes] == pytest.approx(EXACT.frequency[:2], rel=0.002)
    assert [mode.damping_ratio for mode in modes] == pytest.approx(EXACT.damping_ratio[:2], rel=0.05)


def test_channels_may_have_any_scale() -> None:
    """Shapes come back in the record's units; nothing else changes."""
    channels = record(np.random.default_rng(2), [0, 3, 7])
    plain = identified_modes(channels[0], channels[1:], ground_motions.RATE, Identification())
    scaled = identified_modes(
        1e-3 * channels[0], np.diag([50.0, 2.0]) @ channels[1:], ground_motions.RATE, Identification()
    )
    assert [mode.frequency for mode in scaled] == pytest.approx([mode.frequency for mode in plain])
    for one, other in zip(plain, scaled, strict=True):
        assert other.shape[0] / other.shape[1] == pytest.approx(25 * one.shape[0] / one.shape[1])


@pytest.mark.parametrize("levels", [[7], [3, 7], [1, 2, 3, 4, 5, 6, 7]])
def test_the_true_modes_are_reported_and_barely_any_other(levels: list[int]) -> None:
    """The first three always; what lies within 5 % of a true frequency is that mode, all else at most one."""
    for seed in range(3):
        channels = record(np.random.default_rng(seed), [0, *levels])
        result = np.array([m.frequency for m in identified_modes(channels[0], channels[1:], 100.0, Identification())])
        nearest = np.abs(result[:, None] / EXACT.frequency - 1)
        assert result[:3] == pytest.approx(EXACT.frequency[:3], rel=0.002)
        assert np.sum(nearest.min(axis=1) > 0.05) <= 1


def test_white_noise_has_no_modes() -> None:
    """At most one of ten records of pure noise has modes: measured, 1 in 60 at twelve seconds."""
    identified = 0
    for seed in range(10):
        noise = np.random.default_rng(seed).standard_normal((3, 1200))
        try:
            identified_modes(noise[0], noise[1:], 100.0, Identification())
            identified += 1
        except IdentificationError as refusal:
            assert "longer or stronger record" in str(refusal)  # noqa: PT017  it may also succeed
    assert identified <= 1


def test_refuses_a_dead_channel_with_a_remedy() -> None:
    channels = record(np.random.default_rng(3), [0, 3, 7])
    with pytest.raises(IdentificationError, match="a channel does not move"):
        identified_modes(channels[0], 0 * channels[1:], 100.0, Identification())
    with pytest.raises(IdentificationError, match="fewer block rows, are needed"):
        identified_modes(channels[0, :500], channels[1:, :500], 100.0, replace(Identification(), block_rows=40))


def response(eigenvalue: complex, u: np.ndarray) -> np.ndarray:
    return np.asarray(signal.lfilter([0, 1], [1, -eigenvalue], u).real)


def test_a_mode_counts_by_what_it_alone_explains() -> None:
    """Without the slow mode the misfit grows by its variance over the noise's, but for what the other one imitates."""
    rng = np.random.default_rng(1)
    u, noise = rng.standard_normal((1, 20000)), rng.standard_normal((2, 20000))
    y = np.vstack([response(SLOW, u[0]), 0 * u[0]]) + noise
    increase = misfit_increase(np.array([SLOW, FAST]), u, y)
    assert increase.shape == (2, 2)
    assert increase[0, 0] == pytest.approx(np.var(response(SLOW, u[0])), rel=0.15)
    # Eight coefficients that explain nothing take 8 of 20,000 parts of the misfit away, and three times that at most.
    assert np.delete(increase.ravel(), 0) == pytest.approx(0, abs=24 / 20000)


def test_ringing_down_from_the_start_counts_too() -> None:
    rng = np.random.default_rng(2)
    start = np.real(SLOW ** np.arange(500))
    increase = misfit_increase(
        np.array([SLOW]), 0.01 * rng.standard_normal((1, 500)), start + 0.1 * rng.standard_normal((1, 500))
    )
    assert increase[0, 0] > 1


@pytest.mark.parametrize(
    ("deviation", "increase", "expected"),
    [
        (ModalDeviation(0.01, 0.004), 0.0, True),  # five standard deviations of damping
        (ModalDeviation(0.01, 0.006), 0.0, False),
        (ModalDeviation(0.01, 0.006), 0.2, True),  # poorly determined, but nothing else explains the record
        (None, 0.2, True),
        (None, 0.01, False),
    ],
)
def test_its_damping_or_the_record_supports_a_mode(
    deviation: ModalDeviation | None, increase: float, expected: bool
) -> None:
    assert is_supported(0.02, deviation, increase) is expected


def test_what_the_input_explains_to_the_last_digit_supports_no_mode() -> None:
    u = np.random.default_rng(3).standard_normal((1, 1000))
    assert misfit_increase(np.array([SLOW]), u, 2 * u) == pytest.approx(0, abs=1e-3)
