import numpy as np
import pytest
from scipy import signal

from core.identification.modal_uncertainty import ModalDeviation
from core.identification.mode_support import is_supported, misfit_growth

SLOW, FAST = 0.98 * np.exp(0.3j), 0.95 * np.exp(1.2j)


def response(eigenvalue: complex, u: np.ndarray) -> np.ndarray:
    return np.asarray(signal.lfilter([0, 1], [1, -eigenvalue], u).real)


def test_a_mode_counts_by_what_it_alone_explains() -> None:
    """Without the slow mode the misfit grows by its variance over the noise's, but for what the other one imitates."""
    rng = np.random.default_rng(1)
    u, noise = rng.standard_normal((1, 20000)), rng.standard_normal((2, 20000))
    y = np.vstack([response(SLOW, u[0]), 0 * u[0]]) + noise
    growth = misfit_growth(np.array([SLOW, FAST]), u, y)
    assert growth.shape == (2, 2)
    assert growth[0, 0] == pytest.approx(np.var(response(SLOW, u[0])), rel=0.15)
    # Eight coefficients that explain nothing take 8 of 20,000 parts of the misfit away, and three times that at most.
    assert np.delete(growth.ravel(), 0) == pytest.approx(0, abs=24 / 20000)


def test_ringing_down_from_the_start_counts_too() -> None:
    rng = np.random.default_rng(2)
    start = np.real(SLOW ** np.arange(500))
    growth = misfit_growth(
        np.array([SLOW]), 0.01 * rng.standard_normal((1, 500)), start + 0.1 * rng.standard_normal((1, 500))
    )
    assert growth[0, 0] > 1


@pytest.mark.parametrize(
    ("deviation", "growth", "supported"),
    [
        (ModalDeviation(0.01, 0.004), 0.0, True),  # five standard deviations of damping
        (ModalDeviation(0.01, 0.006), 0.0, False),
        (ModalDeviation(0.01, 0.006), 0.2, True),  # poorly determined, but nothing else explains the record
        (None, 0.2, True),
        (None, 0.01, False),
    ],
)
def test_what_supports_a_mode(deviation: ModalDeviation | None, growth: float, supported: bool) -> None:
    assert is_supported(0.02, deviation, growth) is supported


def test_what_the_input_explains_to_the_last_digit_supports_no_mode() -> None:
    u = np.random.default_rng(3).standard_normal((1, 1000))
    assert misfit_growth(np.array([SLOW]), u, 2 * u) == pytest.approx(0, abs=1e-3)
