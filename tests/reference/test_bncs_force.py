"""The force of a real building from three and from two sensors, against F = -Σ m_i a_i over all six levels."""

import numpy as np
import obspy
import pytest
from scipy import signal
from shared import BNCS, needs_shared

from core.arrays import Matrix
from core.cms import estimate
from core.estimator import InstrumentedSuperstructure

MASS = np.array([231995.0, 68729.0, 71686.0, 105673.0, 109935.0, 60500.0])  # kg, from the base slab up


def accelerations(test: str) -> tuple[Matrix, float]:
    stream = obspy.read(str(BNCS / f"{test}.mseed"), format="MSEED")
    traces = [stream.select(location=f"{level:02d}", channel="HNX")[0] for level in range(1, 7)]
    rate = traces[0].stats.sampling_rate
    band = signal.butter(4, [0.1, 25.0], btype="bandpass", fs=rate, output="sos")
    return signal.sosfiltfilt(band, np.array([trace.data for trace in traces], dtype=float), axis=1), rate


@needs_shared
@pytest.mark.parametrize(
    ("test", "with_fourth_floor", "roof_only"), [("CNP100", 99.0, 95.0), ("LAC100", 98.7, 92.3), ("SP100", 97.9, 89.2)]
)
def test_fit_of_the_force(test: str, with_fourth_floor: float, roof_only: float) -> None:
    acceleration, rate = accelerations(test)
    truth = -MASS @ acceleration
    for floors, published in (([2, 4], with_fourth_floor), ([4], roof_only)):
        record = InstrumentedSuperstructure(
            rate, acceleration[0], acceleration[1:][floors], np.array(floors), MASS[0], MASS[1:]
        )
        error = np.linalg.norm(truth - estimate(record).force) / np.linalg.norm(truth - truth.mean())
        assert 100 * (1 - error) == pytest.approx(published, abs=0.1)  # one unit of the published digit
