"""How does each level move as one rigid slab: its centre of mass, and its torsion?

A sensor at (x, y) from the centre of mass reads u = U − θ y in direction x and v = V + θ x in direction y, for
torsions small enough that cos θ = 1. Where a level has more than one sensor in a direction, and positions tell them
apart, U, V and θ are their least squares; where they do not, the mean stands for the centre of mass.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Matrix, Vector
from core.quality import Finding
from core.record import Channel, Quantity, Record

SHORTEST_ARM = 0.5
"""m, between two sensors: a torsion is not told from sensors that stand side by side."""

Key = tuple[str, Quantity]
"""Name of a level, and what is measured there."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidLevels:
    """The levels' motion as that of rigid slabs."""

    record: Record
    """One channel for each level, quantity and direction."""
    torsion: Mapping[Key, Vector]
    """(n,) rad, or rad/s² of accelerations, from x towards y, of the levels of which it is determined."""
    findings: tuple[Finding, ...]


def rigid_levels(record: Record) -> RigidLevels:
    """A record of one channel for each level, quantity and direction, and the torsions that are known besides.

    Args:
        record: complete channels about their position at rest, any number for each level and direction.
    """
    groups: dict[Key, list[int]] = {}
    for row, channel in enumerate(record.channels):
        groups.setdefault((channel.level, channel.quantity), []).append(row)
    channels, rows, torsion, found = list[Channel](), list[Vector](), dict[Key, Vector](), list[Finding]()
    for key, members in groups.items():
        sensors, samples = [record.channels[row] for row in members], record.samples[members]
        combined = _combined(sensors)
        channels += combined
        weights, turning = _weights(sensors, combined)
        rows += list(weights @ samples)
        if turning is not None:
            torsion[key] = turning @ samples
        elif len({one.direction for one in combined} - {"z"}) < sum(sensor.direction != "z" for sensor in sensors):
            found.append(_without_torsion(sensors))
    return RigidLevels(replace(record, channels=tuple(channels), samples=np.array(rows)), torsion, tuple(found))


def _combined(sensors: Sequence[Channel]) -> list[Channel]:
    """A channel for each direction, at the centre of mass; its id is those of its sensors."""
    combined = []
    for direction in dict.fromkeys(sensor.direction for sensor in sensors):
        own = [sensor for sensor in sensors if sensor.direction == direction]
        joint = replace(own[0], id=" + ".join(sensor.id for sensor in own), position=None, rotation=0.0)
        combined.append(joint if len(own) > 1 else own[0])
    return combined


def _weights(sensors: Sequence[Channel], combined: Sequence[Channel]) -> tuple[Matrix, Vector | None]:
    """(combined, sensors) weights of the translations, and (sensors,) 1/m of the torsion, None if it is not known."""
    design = rigid_design(sensors)
    if design is None or design.shape[1] == len(combined):
        belongs = _directions(sensors).T
        return np.asarray(belongs / belongs.sum(axis=1, keepdims=True)), None
    solved = np.asarray(np.linalg.pinv(design))
    return solved[:-1], solved[-1]


def rigid_design(sensors: Sequence[Channel]) -> Matrix | None:
    """(sensors, directions) or (sensors, directions + 1) what each reads of every translation, and of the torsion.

    The torsion is left out where it cannot be told from the translations.

    Returns:
        None if a sensor that shares its direction with others has no position.
    """
    belongs = _directions(sensors)
    shared = belongs @ belongs.sum(axis=0) > 1
    fine = [sensor.position is not None or sensor.direction == "z" for sensor in sensors]
    if not all(known or not more for known, more in zip(fine, shared, strict=True)):
        return None
    arms = np.array([_arm(sensor) for sensor in sensors])
    beside = arms - belongs @ (belongs.T @ arms / belongs.sum(axis=0))
    # of two sensors a distance d apart the norm is d / √2
    if np.linalg.norm(beside) < SHORTEST_ARM / np.sqrt(2):
        return belongs
    return np.column_stack([belongs, arms])


def _directions(sensors: Sequence[Channel]) -> Matrix:
    """(sensors, directions) 1 where a sensor measures in a direction, in order of their first sensors."""
    directions = dict.fromkeys(sensor.direction for sensor in sensors)
    return np.array([[float(sensor.direction == direction) for direction in directions] for sensor in sensors])


def _arm(sensor: Channel) -> float:
    """m: what the sensor reads of a torsion of 1 rad."""
    x, y = sensor.position or (0.0, 0.0)
    return -y if sensor.direction == "x" else x if sensor.direction == "y" else 0.0


def _without_torsion(sensors: Sequence[Channel]) -> Finding:
    level, quantity = sensors[0].level, sensors[0].quantity
    message = (
        f"several channels measure the {quantity} of level {level!r} in one direction, but their positions do not tell "
        "its torsion: their mean was used; position = [x, y] of each in the building file would do"
    )
    return Finding("position", "note", message)
