import numpy as np
import pytest

from core.errors import RecordError
from core.paper import DURATION, LEAD, PEAK, RATE, ground_motion
from service.akt013 import recorded


def test_a_recorded_motion_is_at_rest_around_and_has_the_papers_peak() -> None:
    motion = ground_motion(*recorded())
    assert motion.size == DURATION * RATE
    assert np.abs(motion).max() == pytest.approx(PEAK, rel=1e-12)  # rounding
    assert np.abs(motion[: round(LEAD * RATE / 2)]).max() < 1e-3 * PEAK  # a zero-phase filter rings before the onset
    assert np.abs(motion[-1000:]).max() < 1e-3 * PEAK


@pytest.mark.parametrize("rate", [50.0, 200.0])
def test_the_rate_of_the_record_does_not_matter(rate: float) -> None:
    """A wave of 2 Hz in a window of 60 s, sampled at two rates: the resampling filter's ripple is below 1 %."""
    time, reference = np.arange(0, 60, 1 / rate), np.arange(0, 60, 1 / RATE)
    motions = [
        ground_motion(np.hanning(t.size) * np.sin(4 * np.pi * t), r) for t, r in ((time, rate), (reference, RATE))
    ]
    assert np.abs(motions[0] - motions[1]).max() < 0.01 * PEAK


def test_too_long_a_record_and_one_at_rest_are_refused() -> None:
    with pytest.raises(RecordError, match="170 s or less"):
        ground_motion(np.ones(20_000), RATE)
    with pytest.raises(RecordError, match="does not move"):
        ground_motion(np.ones(2_000), RATE)
