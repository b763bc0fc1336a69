"""A record is relied on but near an end that is in motion."""

import numpy as np
import pytest

from core.arrays import Vector
from core.fitting.record_ends import FADED, IGNORED, relied_on

RATE = 100.0


def force(seconds: float, begins: float, ends: float) -> Vector:
    """N: 1 Hz, for two seconds at the ends as strong as is said, 1 in between."""
    time = np.arange(0, seconds, 1 / RATE)
    strength = np.interp(time, [2, seconds / 3, 2 * seconds / 3, seconds - 2], [begins, 1.0, 1.0, ends])
    return np.asarray(strength * np.sin(2 * np.pi * time))


def test_all_of_a_record_that_begins_and_ends_at_rest() -> None:
    assert relied_on(force(60, 0.0, 0.0), RATE) == pytest.approx(np.ones(6000))


@pytest.mark.parametrize(("begins", "ends"), [(0.3, 0.0), (0.0, 0.3), (0.3, 0.3)])
def test_nothing_at_an_end_in_motion(begins: float, ends: float) -> None:
    found = relied_on(force(90, begins, ends), RATE)
    first, last = (round(one * RATE) for one in (IGNORED, FADED))
    for motion, window in ((begins, found), (ends, found[::-1])):
        assert window[:first].max() == (0.0 if motion else 1.0)
        assert window[last : 60 * 100 // 2].min() == 1.0
    assert (np.diff(found[:4500]) >= 0).all()


def test_a_short_record_keeps_its_middle() -> None:
    found = relied_on(force(20, 1.0, 1.0), RATE)
    assert found[1000] == 1.0
    assert np.mean(found > 0.99) >= 0.5
