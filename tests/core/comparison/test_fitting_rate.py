import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.comparison.fitting_rate import fitting_rate

TRUTH = np.sin(np.linspace(0, 20, 500)) + 0.3


def test_exact_is_a_hundred_and_the_mean_is_zero() -> None:
    assert fitting_rate(TRUTH, TRUTH) == 100.0
    assert fitting_rate(TRUTH, np.full_like(TRUTH, TRUTH.mean())) == pytest.approx(0.0, abs=1e-12)  # rounding


@given(st.floats(0.0, 2.0))
def test_a_scaled_truth_of_zero_mean_is_off_by_the_scale(scale: float) -> None:
    """Figure 15: a force that is a tenth too small fits to 90 %."""
    centred = TRUTH - TRUTH.mean()
    assert fitting_rate(centred, scale * centred) == pytest.approx(100 * (1 - abs(1 - scale)), abs=1e-9)  # rounding
