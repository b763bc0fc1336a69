from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from biaxial_records import biaxial_records, record_of
from ground_motions import RATE
from hypothesis import given, strategies as st

from core.arrays import Vector
from core.description import BuildingDescription, IsolationLayer, Level
from core.record import Channel, Direction, Record
from core.sensors.rigid import rigid_levels, unlike_neighbours

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


def test_without_positions_the_mean_is_taken_and_stated_to_be() -> None:
    channels = (sensor("a", "x", (0.0, 5.0)), sensor("b", "x", None))
    level = rigid_levels(record(*channels))
    assert level.record.find("base slab", "displacement", "x") == pytest.approx(U - 2.5 * TURN)
    assert level.torsion == {}
    assert [(finding.kind, finding.severity) for finding in level.findings] == [("position", "note")]


def test_side_by_side_no_torsion_is_reported() -> None:
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


BASE, LAYER = "XX.PAPER.01.HN", "XX.PAPER.01.HY"
CORNERS = {"A": (10.0, 8.0), "B": (-12.0, -7.0), "C": (9.0, -8.0)}
"""m from the centre of mass; so many sensors of either direction."""


def with_corners(kind: str, corners: int) -> tuple[BuildingDescription, dict[str, Vector]]:
    """The base slab's sensors at so many corners, under a torsion of a fifth of its translation at 10 m."""
    description, samples = biaxial_records()
    of_base = [channel for channel in description.channels if channel.id.startswith(kind)]
    others = tuple(channel for channel in description.channels if channel not in of_base)
    turn = 0.2 * samples[f"{kind}X"] / 10.0
    rng, added = np.random.default_rng(4), list[Channel]()
    for name, (x, y) in list(CORNERS.items())[:corners]:
        for channel in of_base:
            moved = replace(channel, id=f"{channel.id}{name}", position=(x, y))
            added.append(moved)
            exact = samples[channel.id] + turn * (-y if channel.direction == "x" else x)
            samples[moved.id] = exact + 0.01 * exact.std() * rng.standard_normal(exact.size)
    for channel in of_base:
        del samples[channel.id]
    return replace(description, channels=others + tuple(added)), samples


def record_with(description: BuildingDescription, samples: dict[str, Vector]) -> Record:
    return record_of(description.channels, samples)


@pytest.mark.parametrize("kind", [BASE, LAYER])
@pytest.mark.parametrize("corners", [1, 2, 3])
def test_healthy_neighbours_are_left_alone(kind: str, corners: int) -> None:
    description, samples = with_corners(kind, corners)
    assert unlike_neighbours(record_with(description, samples), description) == ()


@pytest.mark.parametrize("kind", [BASE, LAYER])
@pytest.mark.parametrize("corners", [2, 3])
@pytest.mark.parametrize(("reported", "factor"), [("reversed", -1.0), ("unit", 0.1), ("unit", 10.0)])
def test_a_sensor_that_disagrees_with_its_neighbours_is_named(
    kind: str, corners: int, reported: str, factor: float
) -> None:
    description, samples = with_corners(kind, corners)
    wrong = f"{kind}XB"
    samples[wrong] = factor * samples[wrong]
    (finding,) = unlike_neighbours(record_with(description, samples), description)
    assert (finding.kind, finding.channel) == (reported, wrong)


def test_of_two_alone_both_are_named() -> None:
    description, samples = with_corners(LAYER, 2)
    alone = {name: values for name, values in samples.items() if name.startswith(LAYER)}
    alone[f"{LAYER}XA"] = -alone[f"{LAYER}XA"]
    named = {finding.channel for finding in unlike_neighbours(record_with(description, alone), description)}
    assert named == {f"{LAYER}XA", f"{LAYER}XB"}


@pytest.mark.parametrize("corners", [2, 3])
def test_what_is_no_rigid_motion_is_detected_and_with_enough_sensors_named(corners: int) -> None:
    """A gain 1.6 times too large: no gross fault, but four sensors determine three motions, and six identify the
    sensor."""
    description, samples = with_corners(LAYER, corners)
    samples[f"{LAYER}XA"] *= 1.6
    (finding,) = unlike_neighbours(record_with(description, samples), description)
    assert (finding.kind, finding.severity) == ("neighbour", "warning")
    assert finding.channel == (f"{LAYER}XA" if corners == 3 else None)


def test_too_short_a_record_gives_no_finding() -> None:
    description, samples = with_corners(BASE, 2)
    short = {name: values[: round(5 * RATE)] for name, values in samples.items()}
    assert unlike_neighbours(record_with(description, short), description) == ()


@pytest.mark.parametrize("storeys", [20, 40])
def test_two_sensors_on_the_roof_of_a_tall_building_are_compared_where_it_moves_as_one_body(storeys: int) -> None:
    """At resonance with the base slab both of them would disagree with it."""
    rng, count = np.random.default_rng(1), 6000
    frequency = np.fft.rfftfreq(count, 1 / 100.0)
    base = np.fft.irfft(
        np.fft.rfft(rng.standard_normal(count)) * np.exp(-((np.log(np.maximum(frequency, 0.01) / 0.5)) ** 2)), count
    ) * np.hanning(count)
    first = 12.4 / storeys
    transfer = 1 + 1.27 * frequency**2 / (first**2 - frequency**2 + 0.04j * frequency * first)
    roof = np.fft.irfft(np.fft.rfft(base) * transfer, count)
    floors = [Level(f"{n}th", "floor", 1e6) for n in range(storeys)]
    levels = (Level("ground", "ground"), Level("slab", "base", 1e6), *floors)
    channels = [Channel("slab", "slab", "acceleration", "x")]
    channels += [Channel(name, floors[-1].name, "acceleration", "x", (0.0, 0.0)) for name in ("one", "other")]
    description = BuildingDescription("TALL", "tall", levels, IsolationLayer(), tuple(channels))
    twisted = Record(START, 100.0, tuple(channels), np.array([base, 1.5 * roof, 0.5 * roof]))
    named = [(one.kind, one.channel) for one in unlike_neighbours(twisted, description)]
    assert ("incoherent", "one") not in named
    assert ("incoherent", "other") not in named
