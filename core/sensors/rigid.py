"""Levels as rigid slabs: their sensors compared with each other, and combined into translation and torsion.

A sensor at (x, y) from the centre of mass reads u = U − θ y in direction x and v = V + θ x in direction y, for
torsions small enough that cos θ = 1. Where a level has more than one sensor in a direction, and their positions
determine it, U, V and θ are least-squares estimates; elsewhere the mean represents the centre of mass.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Mask, Matrix, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.record import Channel, Finding, Quantity, Record
from core.sensors.agreement import Fault, against, low_spectra
from core.sensors.clock import one_body

SHORTEST_ARM = 0.5
"""m, distance of two sensors below which they do not determine a torsion. Not tuned."""
MAJORITY = 3
"""Fewest sensors whose median represents the slab: with two, neither outvotes the other."""
TORSIONAL = 0.15
"""Power over that of a level's motion in x and y by which a sensor may differ from the expected motion, as torsion may
cause at a corner. Not tuned."""
RIGID = 0.1
"""Share of a level's motion that its sensors may read beside one translation and one torsion. Not tuned."""
CLEARLY = 0.5
"""Ratio of the remainders without the best and without the second-best sensor, below which the best one is at fault. A
choice."""

Key = tuple[str, Quantity]
"""Name of a level, and the quantity measured there."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidLevels:
    """Motion of the levels as rigid slabs."""

    record: Record
    """One channel for each level, quantity and direction."""
    torsion: Mapping[Key, Vector]
    """(n,) rad, or rad/s² for accelerations, from x towards y, of the levels where it is determined."""
    findings: tuple[Finding, ...]


def rigid_levels(record: Record) -> RigidLevels:
    """A record of one channel for each level, quantity and direction, and the torsions that are determined.

    Args:
        record: complete channels relative to their position at rest, any number per level and direction.
    """
    groups: dict[Key, list[int]] = {}
    for row, channel in enumerate(record.channels):
        groups.setdefault((channel.level, channel.quantity), []).append(row)
    channels, rows, torsion, findings = list[Channel](), list[Vector](), dict[Key, Vector](), list[Finding]()
    for key, members in groups.items():
        sensors, samples = [record.channels[row] for row in members], record.samples[members]
        combined = _combined(sensors)
        channels += combined
        weights, turning = _weights(sensors, combined)
        rows += list(weights @ samples)
        if turning is not None:
            torsion[key] = turning @ samples
        elif len({one.direction for one in combined} - {"z"}) < sum(sensor.direction != "z" for sensor in sensors):
            findings.append(_without_torsion(sensors))
    return RigidLevels(replace(record, channels=tuple(channels), samples=np.array(rows)), torsion, tuple(findings))


def _combined(sensors: Sequence[Channel]) -> list[Channel]:
    """A channel for each direction, at the centre of mass; its id joins those of its sensors."""
    combined = []
    for direction in dict.fromkeys(sensor.direction for sensor in sensors):
        own = [sensor for sensor in sensors if sensor.direction == direction]
        joint = replace(own[0], id=" + ".join(sensor.id for sensor in own), position=None, rotation=0.0)
        combined.append(joint if len(own) > 1 else own[0])
    return combined


def _weights(sensors: Sequence[Channel], combined: Sequence[Channel]) -> tuple[Matrix, Vector | None]:
    """(combined, sensors) weights of the translations, and (sensors,) 1/m of the torsion, None if undetermined."""
    design = _design(sensors)
    if design is None or design.shape[1] == len(combined):
        belongs = _directions(sensors).T
        return np.asarray(belongs / belongs.sum(axis=1, keepdims=True)), None
    solved = np.asarray(np.linalg.pinv(design))
    return solved[:-1], solved[-1]


def _design(sensors: Sequence[Channel]) -> Matrix | None:
    """(sensors, directions) or (sensors, directions + 1) reading of each per unit translation, and per unit torsion.

    The torsion is omitted where it cannot be distinguished from the translations.

    Returns:
        None if a sensor that shares its direction with others has no position.
    """
    belongs = _directions(sensors)
    shared = belongs @ belongs.sum(axis=0) > 1
    placed = [sensor.position is not None or sensor.direction == "z" for sensor in sensors]
    if not all(known or not more for known, more in zip(placed, shared, strict=True)):
        return None
    arms = np.array([_arm(sensor) for sensor in sensors])
    beside = arms - belongs @ (belongs.T @ arms / belongs.sum(axis=0))
    # for two sensors at a distance d the norm is d / √2
    if np.linalg.norm(beside) < SHORTEST_ARM / np.sqrt(2):
        return belongs
    return np.column_stack([belongs, arms])


def _directions(sensors: Sequence[Channel]) -> Matrix:
    """(sensors, directions) 1 where a sensor measures in a direction, in order of their first sensors."""
    directions = dict.fromkeys(sensor.direction for sensor in sensors)
    return np.array([[float(sensor.direction == direction) for direction in directions] for sensor in sensors])


def _arm(sensor: Channel) -> float:
    """m, reading of the sensor per radian of torsion."""
    x, y = sensor.position or (0.0, 0.0)
    return -y if sensor.direction == "x" else x if sensor.direction == "y" else 0.0


def _without_torsion(sensors: Sequence[Channel]) -> Finding:
    level, quantity = sensors[0].level, sensors[0].quantity
    message = (
        f"several channels measure the {quantity} of level {level!r} in one direction, but their positions do not "
        "determine its torsion: their mean was used; give each position = [x, y] in the building file"
    )
    return Finding("position", "note", message)


def unlike_neighbours(record: Record, description: BuildingDescription) -> tuple[Finding, ...]:
    """Channels that do not move as their neighbours, and levels whose sensors read more than a rigid motion.

    With three sensors or more in one direction, the median represents the slab; with two, the other levels do, which
    move alike below the first fixed-base frequency. Where two contradict each other and nothing distinguishes them,
    both are named. Channels that are too weak at low frequencies are not judged.

    Args:
        record: complete channels relative to their position at rest, any number per level and direction.
        description: of the building.
    """
    channels, values, frequency = _accelerations(record)
    low = one_body(frequency, description)
    faults = [fault for rows in _groups(channels) for fault in _outvoted(channels, values, rows, description, low)]
    faulty = {fault.channel for fault in faults}
    right = [row for row, channel in enumerate(channels) if channel not in faulty]
    findings = (fault.finding(description) for fault in faults)
    return (*findings, *_not_rigid([channels[row] for row in right], values[right]))


def _accelerations(record: Record) -> tuple[list[Channel], ComplexMatrix, Vector]:
    """Horizontal channels that are clear above their noise, (channels, frequencies) accelerations, and frequencies."""
    rows = [row for row, channel in enumerate(record.channels) if channel.direction in ("x", "y")]
    channels = [record.channels[row] for row in rows]
    try:
        low = low_spectra(record.samples[rows], record.rate)
    except RecordError:  # too short to estimate its noise: no channel is judged
        return [], np.empty((0, 0), dtype=complex), np.empty(0)
    accelerations = low.accelerations([channel.quantity for channel in channels])
    kept = [channel for channel, usable in zip(channels, low.clear, strict=True) if usable]
    return kept, accelerations.values[low.clear], low.frequency


def _groups(channels: Sequence[Channel]) -> Iterator[list[int]]:
    """Rows of the channels that share level, quantity and direction with another."""
    groups: dict[tuple[str, str, str | None], list[int]] = {}
    for row, channel in enumerate(channels):
        groups.setdefault((channel.level, channel.quantity, channel.direction), []).append(row)
    return (rows for rows in groups.values() if len(rows) > 1)


def _outvoted(
    channels: Sequence[Channel],
    values: ComplexMatrix,
    rows: Sequence[int],
    description: BuildingDescription,
    low: Mask,
) -> Iterator[Fault]:
    """Sensors of one level that do not move as their neighbours or, where (frequencies,) `low`, as other levels."""
    own = channels[rows[0]]
    if own.quantity == "acceleration" and own.level != description.ground.name and len(rows) < MAJORITY and low.any():
        values = values[:, low]
    others = _other_levels(channels, values, own, description) if low.any() else None
    power = _power_of_level(channels, values, own)
    for row in rows:
        if len(rows) >= MAJORITY:
            expected, name = _median(values[list(rows)]), "its neighbours"
        elif others is not None:
            expected, name = others, "the other levels"
        else:
            expected, name = values[next(other for other in rows if other != row)], "its neighbour"
        if np.linalg.norm(values[row] - expected) ** 2 > TORSIONAL * power:
            yield from against(channels[row], values[row], expected, name)


def _power_of_level(channels: Sequence[Channel], values: ComplexMatrix, own: Channel) -> float:
    """Power of the level's motion in x and y together, each from the sensor that moves most."""
    most: dict[str | None, float] = {}
    for channel, motion in zip(channels, values, strict=True):
        if (channel.level, channel.quantity) == (own.level, own.quantity):
            power = float(np.linalg.norm(motion) ** 2)
            most[channel.direction] = max(power, most.get(channel.direction, 0.0))
    return sum(most.values())


def _median(values: ComplexMatrix) -> ComplexVector:
    return np.asarray(np.median(values.real, axis=0) + 1j * np.median(values.imag, axis=0))


def _other_levels(
    channels: Sequence[Channel], values: ComplexMatrix, own: Channel, description: BuildingDescription
) -> ComplexVector | None:
    """Motion expected from the levels that move as this one; None if they have no sensor."""

    def median_of(levels: set[str]) -> ComplexVector | None:
        rows = [
            row
            for row, other in enumerate(channels)
            if other.quantity == "acceleration" and other.direction == own.direction and other.level in levels
        ]
        return _median(values[rows]) if rows else None

    base, ground = description.base.name, description.ground.name
    if own.quantity == "displacement":
        above, below = median_of({base}), median_of({ground})
        return None if above is None or below is None else above - below
    alike = set() if own.level == ground else {base, *(floor.name for floor in description.floors)}
    return median_of(alike - {own.level})


def _not_rigid(channels: Sequence[Channel], values: ComplexMatrix) -> Iterator[Finding]:
    """Levels whose redundant sensors do not read one rigid motion, and the sensor at fault if it is clear."""
    for level, quantity in sorted({(channel.level, channel.quantity) for channel in channels}):
        rows = [i for i, channel in enumerate(channels) if (channel.level, channel.quantity) == (level, quantity)]
        beside = _beside_rigid(channels, values, rows)
        if beside <= RIGID:
            continue
        without = {row: _beside_rigid(channels, values, [one for one in rows if one != row]) for row in rows}
        farthest, next_to_it = sorted(without, key=without.__getitem__)[:2]
        message = (
            f"the {quantity} channels of level {level!r} read {100 * beside:.0f} % of their motion beside one "
            "translation and one torsion; check gains, positions and clocks"
        )
        is_clear = without[farthest] < CLEARLY * without[next_to_it]
        yield Finding("neighbour", "warning", message, channels[farthest].id if is_clear else None, beside)


def _beside_rigid(channels: Sequence[Channel], values: ComplexMatrix, rows: Sequence[int]) -> float:
    """Share of the motion, in root mean square, that no rigid motion explains."""
    design, own = _design([channels[row] for row in rows]), values[list(rows)]
    if design is None or design.shape[0] <= design.shape[1]:
        return 0.0
    residual = own - design @ (np.linalg.pinv(design) @ own)
    return float(np.linalg.norm(residual) / np.linalg.norm(own))
