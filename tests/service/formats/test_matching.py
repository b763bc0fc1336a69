import re
from datetime import UTC, datetime

import numpy as np
import pytest

from core.record import Channel
from service.formats import FormatError, Trace, of_building

CHANNELS = (
    Channel("XX.TOWER.01.HNX", "slab", "acceleration", "x"),
    Channel("XX.TOWER.01.HYX", "slab", "displacement", "x"),
)
START = datetime(2024, 1, 1, tzinfo=UTC)


def trace(
    channel: str = "XX.TOWER.01.HNX", peak: float = 1.0, gain: float = 1.0, quantity: str = "acceleration"
) -> Trace:
    samples = peak * np.sin(np.arange(1000) / 10)
    return Trace(channel, START, 100.0, samples, gain, quantity)


def test_the_buildings_own_traces_are_kept() -> None:
    own, other = trace(), trace("XX.TOWER.99.HNX")
    assert of_building([own, other], CHANNELS) == (own,)


def test_an_unknown_network_is_refused() -> None:
    with pytest.raises(FormatError, match=r"found ZZ.TOWER.01.HNX; the building has XX.TOWER.01.HNX, XX.TOWER.01.HYX"):
        of_building([trace("ZZ.TOWER.01.HNX")], CHANNELS)


def test_a_unit_of_another_quantity_is_refused() -> None:
    with pytest.raises(FormatError, match=r"measures displacement according to the building file, but .* acceleration"):
        of_building([trace("XX.TOWER.01.HYX")], CHANNELS)


@pytest.mark.parametrize("wrong", [1e5, 980.665])
def test_samples_that_no_building_has_seen_are_in_another_unit(wrong: float) -> None:
    """Counts taken for m/s², and 1 g in gal taken for m/s²."""
    with pytest.raises(FormatError, match=re.escape("m/s² from their median, which no building does")):
        of_building([trace(peak=wrong)], CHANNELS)


def test_an_offset_or_a_spike_is_not_mistaken_for_a_wrong_unit() -> None:
    tilted = Trace("XX.TOWER.01.HNX", START, 100.0, trace().numbers + 9.81e3, 1.0, "acceleration")
    tilted.numbers[500] = 1e6
    assert of_building([tilted], CHANNELS) == (tilted,)
