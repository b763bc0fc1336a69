"""Records that the memory would not hold on one time base are refused before anything is made of them."""

import tracemalloc
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import simulated

from core.record import Segment
from core.sensors.preparation import prepared
from service.buildings import description as building_description

START = datetime(2024, 1, 1, tzinfo=UTC)


def test_an_event_of_four_months_is_refused_with_its_length() -> None:
    """At 0.0001 Hz: 1000 samples; at the chain's 100 Hz thousands of millions in each channel."""
    description = building_description.read(simulated.building_file(), Path("/")).description
    channels = [channel.id for channel in description.channels]
    slow = [Segment(channel, START, 1e-4, np.zeros(1000)) for channel in channels]
    apart = [Segment(channels[0], START + timedelta(days=n), 100.0, np.zeros(1000)) for n in (0, 116)]
    tracemalloc.start()
    for segments in (slow, apart):
        preparation = prepared(segments, description, 100.0)
        (finding,) = preparation.findings
        assert preparation.record is None
        assert finding.severity == "fatal"
        assert finding.message.startswith("the event lasts 2.78e+03 h, 1e+09 samples a channel; at most 2.5e+07 are")
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()
