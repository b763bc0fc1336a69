from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from core.identification.projection import project
from core.identification.stabilisation import (
    DiagramPole,
    StabilityCriteria,
    even_orders,
    is_same_pole,
    stabilisation_diagram,
    stable_modes,
)
from core.identification.subspace import extended_observability, moesp

STABILITY = StabilityCriteria()
RATE = 20.0


def pole(order: int, frequency: float = 2.0, damping_ratio: float = 0.02, *, is_stable: bool = True) -> DiagramPole:
    s = 2 * np.pi * frequency * (-damping_ratio + 1j * np.sqrt(1 - damping_ratio**2))
    shape = np.array([0.5, 1.0], dtype=complex)
    return DiagramPole(order, complex(np.exp(s / RATE)), frequency, damping_ratio, shape, is_stable)


def test_orders_are_even_up_to_the_largest() -> None:
    assert list(even_orders(8)) == list(even_orders(9)) == [2, 4, 6, 8]


def test_what_counts_as_the_same_mode() -> None:
    assert is_same_pole(pole(10, 2.039), pole(8), STABILITY)
    assert not is_same_pole(pole(10, 2.041), pole(8), STABILITY)
    assert is_same_pole(pole(10, damping_ratio=0.0259), pole(8), STABILITY)
    assert not is_same_pole(pole(10, damping_ratio=0.0261), pole(8), STABILITY)
    assert not is_same_pole(replace(pole(10), shape=np.array([-0.5, 1.0], dtype=complex)), pole(8), STABILITY)


def test_a_column_gives_its_median_damping_ratio_at_unbiased_orders() -> None:
    ratios = {8: 0.0225, 10: 0.020, 12: 0.022, 14: 0.021}
    (mode,) = stable_modes([pole(order, damping_ratio=ratio) for order, ratio in ratios.items()], STABILITY)
    assert (mode.order, mode.damping_ratio) == (14, 0.021)


def test_a_pole_that_does_not_stay_is_no_mode() -> None:
    steady = [pole(order) for order in range(4, 26, 2)]
    passing = [pole(order, frequency=5.0) for order in (6, 8, 10)]
    assert [mode.frequency for mode in stable_modes([*steady, *passing], STABILITY)] == [2.0]
    assert stable_modes([pole(order, is_stable=False) for order in range(4, 26, 2)], STABILITY) == ()


def test_a_mode_that_only_low_orders_hold_is_not_reported() -> None:
    assert stable_modes([pole(order) for order in (4, 6, 8)], STABILITY) == ()


def test_diagram_of_one_mode_in_noise() -> None:
    """One mode of 2 Hz and 2 %: stable at every order from the second on, and the only stable one."""
    rng = np.random.default_rng(12)
    u = rng.standard_normal((1, 6000))
    w = pole(0).eigenvalue
    response = 2 * signal.lfilter([0, 1], [1, -w], u[0]).real
    y = np.vstack([0.5 * response, response]) + 0.01 * rng.standard_normal((2, 6000))
    diagram = stabilisation_diagram(extended_observability(project(u, y, 15), moesp), even_orders(16), RATE, STABILITY)
    near = [one for one in diagram if abs(one.frequency - 2.0) < 0.01]
    assert [one.order for one in near] == list(even_orders(16))
    assert [one.is_stable for one in near] == [False] + 7 * [True]
    assert all(0 < one.damping_ratio < STABILITY.largest_damping_ratio for one in diagram)
    assert all(one.frequency < STABILITY.highest_frequency * RATE for one in diagram)
    (mode,) = stable_modes(diagram, STABILITY)
    # 1 % of noise on 6,000 samples of a response that white noise drives: a part in a thousand, generously.
    assert (mode.frequency, mode.damping_ratio) == (pytest.approx(2.0, rel=1e-3), pytest.approx(0.02, rel=2e-2))


def test_orders_beyond_the_data_are_skipped() -> None:
    rng = np.random.default_rng(13)
    u = rng.standard_normal((1, 500))
    y = 2 * signal.lfilter([0, 1], [1, -pole(0).eigenvalue], u).real
    diagram = stabilisation_diagram(extended_observability(project(u, y, 4), moesp), even_orders(20), RATE, STABILITY)
    assert diagram
    assert max(one.order for one in diagram) <= 4
