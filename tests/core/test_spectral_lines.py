import numpy as np
import pytest
from exact_lines import PAPER, RATE, SAMPLES, exact

LINES = exact(PAPER, np.random.default_rng(1))


def test_thinned_lines_stand_for_all() -> None:
    few = LINES.thinned(0.01)
    assert few.angular.size < LINES.angular.size / 2
    assert few.weight.sum() == pytest.approx(LINES.weight.sum())
    assert few.spectra[:, 0] == pytest.approx(LINES.spectra[:, 0])


def test_thinned_lines_are_as_far_apart_as_asked() -> None:
    """A hundredth of their frequency, within one line; every line where they are farther apart than that anyway."""
    few, spacing = LINES.thinned(0.01), 2 * np.pi * RATE / SAMPLES
    apart = np.diff(few.angular) / spacing
    asked = np.maximum(1.0, 0.01 * few.angular[1:] / spacing)
    assert np.abs(apart - asked).max() < 1.5
    assert np.abs(apart[few.angular[1:] < 60 * spacing] - 1).max() < 1e-6


def test_thinning_by_nothing_keeps_all() -> None:
    assert LINES.thinned(0.0).angular == pytest.approx(LINES.angular)
