from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.record import Channel, Direction, Record
from core.sensors.rigid import rigid_levels

START = datetime(2024, 1, 1, tzinfo=UTC)
U, V, TURN = np.random.default_rng(1).standard_normal((3, 50)) * [[1.0], [1.0], [0.01]]
METRES = st.floats(-30, 30)
Place = tuple[float, float]


def sensor(name: str, direction: Direction, position: tuple[float, float] | None) -> Channel:
    return Channel(name, "base slab", "displacement", direction, position)


def reading(channel: Channel) -> np.ndarray:
    x, y = channel.position or (0.0, 0.0)
    return U - TURN * y if channel.direction == "x" else V + TURN * x


def record(*channels: Channel) -> Record:
    return Record(START, 100.0, channels, np.array([reading(channel) for channel in channels]))


@given(xs=st.tuples(METRES, METRES), ys=st.tuples(METRES, METRES), third=st.tuples(METRES, METRES))
def test_any_three_or_four_sensors_give_translation_and_torsion(xs: Place, ys: Place, third: Place) -> None:
    """Wherever two in one direction lie apart across it."""
    if abs(xs[1] - ys[1]) < 1.0:
        return
    level = rigid_levels(record(sensor("a", "x", xs), sensor("b", "x", ys), sensor("c", "y", third)))
    x, y = (level.record.find("base slab", "displacement", direction) for direction in ("x", "y"))
    assert x == pytest.approx(U, abs=1e-9)
    assert y == pytest.approx(V, abs=1e-9)
    assert level.torsion["base slab", "displacement"] == pytest.approx(TURN, abs=1e-9)
    assert level.findings == ()
    assert [channel.id for channel in level.record.channels] == ["a + b", "c"]


def test_two_of_y_and_one_of_x_beside_the_centre() -> None:
    """The one x is freed of the torsion as well."""
    level = rigid_levels(record(sensor("a", "x", (0, 8)), sensor("b", "y", (-9, 0)), sensor("c", "y", (11, 0))))
    assert level.record.find("base slab", "displacement", "x") == pytest.approx(U)
    assert level.record.find("base slab", "displacement", "y") == pytest.approx(V)


def test_without_positions_the_mean_is_taken_and_said_to_be() -> None:
    channels = (sensor("a", "x", (0.0, 5.0)), sensor("b", "x", None))
    level = rigid_levels(record(*channels))
    assert level.record.find("base slab", "displacement", "x") == pytest.approx(U - 2.5 * TURN)
    assert level.torsion == {}
    assert [(finding.kind, finding.severity) for finding in level.findings] == [("position", "note")]


def test_side_by_side_no_torsion_is_told() -> None:
    level = rigid_levels(record(sensor("a", "x", (3.0, 5.0)), sensor("b", "x", (-3.0, 5.1))))
    assert level.torsion == {}
    assert level.record.find("base slab", "displacement", "x") == pytest.approx(U - 5.05 * TURN)


def test_one_sensor_a_direction_is_left_as_it_is() -> None:
    channels = (sensor("a", "x", (0.0, 5.0)), sensor("b", "y", (4.0, 0.0)), sensor("c", "z", None))
    before = record(*channels)
    level = rigid_levels(before)
    assert level.record.channels == channels
    assert (level.record.samples == before.samples).all()
    assert level.findings == ()


def test_vertical_sensors_are_averaged() -> None:
    channels = (sensor("a", "z", (1.0, 5.0)), sensor("b", "z", None))
    level = rigid_levels(record(*channels))
    assert len(level.record.channels) == 1
    assert level.findings == ()
