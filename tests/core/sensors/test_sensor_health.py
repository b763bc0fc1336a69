"""Of one event: how loud each sensor is at rest, and which of them reads more than the others do."""

from dataclasses import replace

import numpy as np
import pytest
from agreed_records import ROWS, described_record
from described import BASE, FOURTH, GROUND, LAYER, ROOF, paper, records

from core.record import Channel, Record
from core.sensors.sensor_health import SensorHealth, sensor_health

GAIN = 1.08


def found(record: Record) -> dict[str, SensorHealth]:
    return {one.channel: one for one in sensor_health(record, record, paper())}


@pytest.mark.parametrize("erring", ROWS)
def test_the_sensor_that_was_swapped_reads_more_and_no_other_does(erring: str) -> None:
    """Within half a per cent: what is left of the model of one mode of the superstructure is a quarter of that."""
    health = found(described_record({erring: np.array([np.log(GAIN), 0.0, 0.0])}, 0.01, [1], ()))
    for name in ROWS:
        assert health[name].gain == pytest.approx(GAIN if name == erring else 1.0, abs=0.005)
        assert 0 < (health[name].gain_std or 0) < 0.005


def test_noise_is_that_of_each_sensor_at_rest() -> None:
    """The paper's building in AKT013, which hardly comes to rest within its record: the level is an upper bound."""
    exact = records(3, noise=0.0)
    levels = {GROUND: 1e-2, BASE: 2e-2, FOURTH: 4e-2, ROOF: 8e-2, LAYER: 1e-4}
    rng = np.random.default_rng(4)
    rows = np.array([exact[name] + std * rng.standard_normal(exact[name].size) for name, std in levels.items()])
    channels = tuple(channel for name in levels for channel in paper().channels if channel.id == name)
    health = found(replace(described_record({}, 0.01, [1], ()), channels=channels, samples=rows))
    for name, std in levels.items():
        assert health[name].noise == pytest.approx(std, rel=0.1)  # of a median over some 100 lines


def test_two_sensors_share_what_they_differ_by() -> None:
    """Nothing tells which of two it is that reads more."""
    health = found(described_record({ROOF: np.array([np.log(GAIN), 0.0, 0.0])}, 0.01, [1], (GROUND, FOURTH, LAYER)))
    assert health[ROOF].gain == pytest.approx(np.sqrt(GAIN), abs=0.005)
    assert health[BASE].gain == pytest.approx(1 / np.sqrt(GAIN), abs=0.005)


def test_what_nothing_tells_is_not_known() -> None:
    alone = described_record({}, 0.01, [1], (GROUND, FOURTH, ROOF, LAYER))
    assert [(one.channel, one.gain, one.gain_std) for one in sensor_health(alone, alone, paper())] == [
        (BASE, None, None)
    ]
    short = replace(alone, samples=alone.samples[:, :500])
    assert found(short)[BASE].noise is None
    vertical = replace(alone, channels=(Channel("z", "1F", "acceleration", "z"),))
    assert found(vertical)["z"].gain is None
