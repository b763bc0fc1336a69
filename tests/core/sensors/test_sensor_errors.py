"""The faulty one of several sensors that disagree is named, with its error and no other sensor's."""

from dataclasses import replace

import numpy as np
import pytest
from building_models import BASE, FOURTH, GROUND, LAYER, ROOF, paper, records
from consistent_records import ROWS, consistent_record, differences
from hypothesis import given, settings, strategies as st

from core.arrays import Vector
from core.record import Channel, Record
from core.sensors.sensor_errors import SensorDifference, SensorHealth, sensor_errors, sensor_health


def earthquakes(
    errors: dict[str, Vector], noise: float = 0.03, seed: int = 0, without: tuple[str, ...] = ()
) -> list[SensorDifference]:
    """Differences in two earthquakes."""
    records = [consistent_record(errors, noise, [seed, number], without) for number in range(2)]
    return [one for record in records for one in differences(record)["x"]]


@pytest.mark.parametrize("noise", [0.01, 0.03, 0.1])
def test_sensors_that_agree_are_not_blamed(noise: float) -> None:
    for seed in range(2):
        assert sensor_errors(earthquakes({}, noise, seed)) == ()


@settings(max_examples=8, deadline=None)
@given(
    st.sampled_from(ROWS),
    st.sampled_from(["gain", "delay", "clock"]),
    st.floats(0.06, 0.2),
    st.sampled_from([-1.0, 1.0]),
    st.integers(0, 1000),
)
def test_the_one_that_errs_is_named(name: str, part: str, size: float, sign: float, seed: int) -> None:
    """Within five standard deviations, which know that a sound sensor's gain is to 1 % and its clock to 1 ms."""
    scale = {"gain": [1.0, 0.0, 0.0], "delay": [0.0, 0.15, 0.0], "clock": [0.0, 0.0, 5e-3]}[part]
    error = sign * size * np.array(scale)
    (healths,) = sensor_errors(earthquakes({name: error}, 0.03, seed))
    assert (healths.channel, healths.part, healths.others) == (name, part, ())
    expected = {"gain": error[:1], "delay": error[1:2], "clock": error[1:]}[part]
    assert (np.abs(healths.value - expected) < 5 * np.sqrt(np.diag(healths.covariance))).all()


def test_two_that_err_are_both_named() -> None:
    errors = {ROOF: np.array([0.15, 0.0, 0.0]), LAYER: np.array([0.0, 0.02, 0.0])}
    healths = sensor_errors(earthquakes(errors))
    assert {(one.channel, one.part) for one in healths} == {(ROOF, "gain"), (LAYER, "delay")}


def test_of_two_sensors_either_may_err() -> None:
    """Without a transducer and with one floor only, the base slab reading too little would be the same."""
    error = {ROOF: np.array([0.15, 0.0, 0.0])}
    (healths,) = sensor_errors(earthquakes(error, without=(LAYER, FOURTH)))
    assert {healths.channel, *healths.others} == {BASE, ROOF}


def test_nothing_is_known_of_one_sensor_alone() -> None:
    assert sensor_errors(earthquakes({}, without=(GROUND, FOURTH, ROOF, LAYER))) == ()
    assert sensor_errors([]) == ()


GAIN = 1.08


def healths(record: Record) -> dict[str, SensorHealth]:
    return {one.channel: one for one in sensor_health(record, differences(record).values())}


@pytest.mark.parametrize("erring", ROWS)
def test_the_sensor_that_was_swapped_reads_more_and_no_other_does(erring: str) -> None:
    """Within half a per cent: what is left of the model of one mode of the superstructure is a quarter of that."""
    health = healths(consistent_record({erring: np.array([np.log(GAIN), 0.0, 0.0])}, 0.01, [1], ()))
    for name in ROWS:
        assert health[name].gain == pytest.approx(GAIN if name == erring else 1.0, abs=0.005)
        assert 0 < (health[name].gain_std or 0) < 0.005


def test_noise_is_that_of_each_sensor_at_rest() -> None:
    """The paper's building in AKT013, which barely comes to rest within its record: the level is an upper bound."""
    exact = records(3, noise=0.0)
    levels = {GROUND: 1e-2, BASE: 2e-2, FOURTH: 4e-2, ROOF: 8e-2, LAYER: 1e-4}
    rng = np.random.default_rng(4)
    rows = np.array([exact[name] + std * rng.standard_normal(exact[name].size) for name, std in levels.items()])
    channels = tuple(channel for name in levels for channel in paper().channels if channel.id == name)
    health = healths(replace(consistent_record({}, 0.01, [1], ()), channels=channels, samples=rows))
    for name, std in levels.items():
        assert health[name].noise == pytest.approx(std, rel=0.1)  # of a median over some 100 lines


def test_two_sensors_share_what_they_differ_by() -> None:
    """Nothing shows which of two sensors reads more."""
    health = healths(consistent_record({ROOF: np.array([np.log(GAIN), 0.0, 0.0])}, 0.01, [1], (GROUND, FOURTH, LAYER)))
    assert health[ROOF].gain == pytest.approx(np.sqrt(GAIN), abs=0.005)
    assert health[BASE].gain == pytest.approx(1 / np.sqrt(GAIN), abs=0.005)


def test_what_nothing_shows_is_not_known() -> None:
    alone = consistent_record({}, 0.01, [1], (GROUND, FOURTH, ROOF, LAYER))
    assert [(one.channel, one.gain, one.gain_std) for one in healths(alone).values()] == [(BASE, None, None)]
    short = replace(alone, samples=alone.samples[:, :500])
    assert healths(short)[BASE].noise is None
    vertical = replace(alone, channels=(Channel("z", "1F", "acceleration", "z"),))
    assert healths(vertical)["z"].gain is None
