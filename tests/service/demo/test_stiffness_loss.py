"""The demonstration's building that loses stiffness: the loss is in its layer and in its records, not in results."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from obspy import UTCDateTime

from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from service.buildings import description
from service.demo.earthquakes import Earthquake, GroundMotion
from service.demo.scenario import STIFFNESS_LOSS
from service.demo.site import RATE, THERMOMETER, building_file as written
from service.demo.stage import prepared
from service.demo.stiffness_loss import (
    LAST_HEALTHY,
    LOSS,
    PER_KELVIN,
    REFERENCE,
    STRONG,
    layer,
    peaks,
    response,
    temperature,
)
from service.records.fdsn_query import Selection

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def earthquake(number: int, arrival: datetime = NOW) -> Earthquake:
    return Earthquake(number, arrival, "one", 1.0, 2e4)


def test_rubber_and_dampers_are_softer_from_the_damage_on_and_in_warmth() -> None:
    before, after = (layer(earthquake(number)).effects for number in (LAST_HEALTHY - 1, LAST_HEALTHY))
    for effect, parameter in (("elastic", "k_b"), ("bouc_wen", "F_y")):
        assert after[effect][parameter] == pytest.approx((1 - LOSS) * before[effect][parameter], rel=1e-12)
        warmth = np.exp(PER_KELVIN * (temperature(NOW) - REFERENCE))
        assert before[effect][parameter] == pytest.approx(warmth * ISOLATOR.effects[effect][parameter], rel=1e-12)
    assert after["viscous"] == before["viscous"] == ISOLATOR.effects["viscous"]
    summer = NOW + timedelta(days=212)
    assert temperature(summer) > temperature(NOW) + 15
    assert layer(earthquake(0, summer)).effects["elastic"]["k_b"] < before["elastic"]["k_b"]


def test_the_damage_is_felt_in_the_motion() -> None:
    ground = np.sin(2 * np.pi * 0.5 * np.arange(500) / RATE)
    healthy, damaged = (response(ground, earthquake(number)).isolator_displacement for number in (0, LAST_HEALTHY))
    np.testing.assert_array_equal(
        damaged, simulate(BUILDING, layer(earthquake(LAST_HEALTHY)), ground, RATE).isolator_displacement
    )
    assert np.abs(damaged - healthy).max() > 0.01 * np.abs(healthy).max()


def test_the_damage_is_done_by_an_earthquake_that_is_as_strong_as_any() -> None:
    found = peaks(STIFFNESS_LOSS.earthquakes, np.random.default_rng(3))
    assert found.argmax() == LAST_HEALTHY - 1
    assert found.max() == pytest.approx(STRONG)
    assert found.size == STIFFNESS_LOSS.earthquakes


def test_the_thermometer_is_described_and_recorded(tmp_path: Path) -> None:
    text = written("http://127.0.0.1/", STIFFNESS_LOSS.sensors)
    channels = {one.id: one for one in description.read(text, tmp_path).description.channels}
    assert (channels[THERMOMETER.id].quantity, channels[THERMOMETER.id].direction) == ("temperature", None)
    rng = np.random.default_rng(7)
    motions = tuple(GroundMotion(name, RATE, rng.standard_normal((2, 1000))) for name in ("one", "another"))
    stage = prepared(tmp_path, STIFFNESS_LOSS, motions, 2, NOW, lambda done, of: None)
    arrival = UTCDateTime(stage.earthquakes[0].arrival)
    (trace,) = stage.archive.waveforms(Selection(start=arrival, end=arrival + 5, channel=THERMOMETER.channel))
    read = float(np.mean(trace.data)) * THERMOMETER.resolution
    assert read == pytest.approx(temperature(stage.earthquakes[0].arrival), abs=0.05)  # 0.2 °C over 500 samples
    (channel,) = [one for one in stage.archive.inventory[0][0] if one.code == THERMOMETER.channel]
    assert channel.response.instrument_sensitivity.input_units == "degC"
