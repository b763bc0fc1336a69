"""Of sensors that disagree, the one that errs is named, with its error and nobody else's."""

import numpy as np
import pytest
from agreed_records import ROWS, described_record
from described import BASE, FOURTH, GROUND, LAYER, ROOF, paper
from hypothesis import given, settings, strategies as st

from core.arrays import Vector
from core.record import Record
from core.sensors.sensor_errors import sensor_errors


def records(
    errors: dict[str, Vector], noise: float = 0.03, seed: int = 0, without: tuple[str, ...] = ()
) -> list[Record]:
    """Of two earthquakes."""
    return [described_record(errors, noise, [seed, number], without) for number in range(2)]


@pytest.mark.parametrize("noise", [0.01, 0.03, 0.1])
def test_sensors_that_agree_are_not_blamed(noise: float) -> None:
    for seed in range(2):
        assert sensor_errors(records({}, noise, seed), paper(), "x") == ()


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
    (found,) = sensor_errors(records({name: error}, 0.03, seed), paper(), "x")
    assert (found.channel, found.part, found.others) == (name, part, ())
    expected = {"gain": error[:1], "delay": error[1:2], "clock": error[1:]}[part]
    assert (np.abs(found.value - expected) < 5 * np.sqrt(np.diag(found.covariance))).all()


def test_two_that_err_are_both_named() -> None:
    errors = {ROOF: np.array([0.15, 0.0, 0.0]), LAYER: np.array([0.0, 0.02, 0.0])}
    found = sensor_errors(records(errors), paper(), "x")
    assert {(one.channel, one.part) for one in found} == {(ROOF, "gain"), (LAYER, "delay")}


def test_of_two_sensors_either_may_err() -> None:
    """Without a transducer and with one floor only, the base slab reading too little would be the same."""
    error = {ROOF: np.array([0.15, 0.0, 0.0])}
    (found,) = sensor_errors(records(error, without=(LAYER, FOURTH)), paper(), "x")
    assert {found.channel, *found.others} == {BASE, ROOF}


def test_nothing_is_known_of_one_sensor_alone() -> None:
    assert sensor_errors(records({}, without=(GROUND, FOURTH, ROOF, LAYER)), paper(), "x") == ()
    assert sensor_errors([], paper(), "x") == ()
