from dataclasses import replace

import numpy as np
import pytest
from biaxial import biaxial, record_of
from motions import RATE

from core.arrays import Vector
from core.description import BuildingDescription
from core.record import Channel, Record
from core.sensors.neighbours import unlike_neighbours

BASE, LAYER = "XX.PAPER.01.HN", "XX.PAPER.01.HY"
CORNERS = {"A": (10.0, 8.0), "B": (-12.0, -7.0), "C": (9.0, -8.0)}
"""m from the centre of mass; so many sensors of either direction."""


def with_corners(kind: str, corners: int) -> tuple[BuildingDescription, dict[str, Vector]]:
    """The base slab's sensors at so many corners, under a torsion of a fifth of its translation at 10 m."""
    description, samples = biaxial()
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


def record(description: BuildingDescription, samples: dict[str, Vector]) -> Record:
    return record_of(description.channels, samples)


@pytest.mark.parametrize("kind", [BASE, LAYER])
@pytest.mark.parametrize("corners", [1, 2, 3])
def test_healthy_neighbours_are_left_alone(kind: str, corners: int) -> None:
    description, samples = with_corners(kind, corners)
    assert unlike_neighbours(record(description, samples), description) == ()


@pytest.mark.parametrize("kind", [BASE, LAYER])
@pytest.mark.parametrize("corners", [2, 3])
@pytest.mark.parametrize(("found", "factor"), [("reversed", -1.0), ("unit", 0.1), ("unit", 10.0)])
def test_a_sensor_that_disagrees_with_its_neighbours_is_named(
    kind: str, corners: int, found: str, factor: float
) -> None:
    description, samples = with_corners(kind, corners)
    wrong = f"{kind}XB"
    samples[wrong] = factor * samples[wrong]
    (finding,) = unlike_neighbours(record(description, samples), description)
    assert (finding.kind, finding.channel) == (found, wrong)


def test_of_two_alone_both_are_named() -> None:
    description, samples = with_corners(LAYER, 2)
    alone = {name: values for name, values in samples.items() if name.startswith(LAYER)}
    alone[f"{LAYER}XA"] = -alone[f"{LAYER}XA"]
    named = {finding.channel for finding in unlike_neighbours(record(description, alone), description)}
    assert named == {f"{LAYER}XA", f"{LAYER}XB"}


@pytest.mark.parametrize("corners", [2, 3])
def test_what_is_no_rigid_motion_is_found_and_with_enough_sensors_named(corners: int) -> None:
    """A gain 1.6 times too large: no gross fault, but four sensors know three motions, and six can tell which it is."""
    description, samples = with_corners(LAYER, corners)
    samples[f"{LAYER}XA"] *= 1.6
    (finding,) = unlike_neighbours(record(description, samples), description)
    assert (finding.kind, finding.severity) == ("neighbour", "warning")
    assert finding.channel == (f"{LAYER}XA" if corners == 3 else None)


def test_too_short_a_record_says_nothing() -> None:
    description, samples = with_corners(BASE, 2)
    short = {name: values[: round(5 * RATE)] for name, values in samples.items()}
    assert unlike_neighbours(record(description, short), description) == ()
