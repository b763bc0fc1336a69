"""Does each sensor of a level move as its neighbours on the same slab do?

Of three or more in one direction the median speaks for the slab; of two, the other levels, which below the first
fixed-base frequency move alike. What several sensors read must besides be one translation and one torsion.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector
from core.description import BuildingDescription
from core.errors import RecordError
from core.quality import Finding
from core.record import Channel, Record
from core.sensors.agreement import Fault, against, low_spectra
from core.sensors.rigid import rigid_design
from core.sensors.screening import loss

MAJORITY = 3
"""Sensors that it takes to outvote one."""
TORSIONAL = 0.15
"""Of the power of a level's motion in x and y: so much beside the expected may be torsion, at a corner."""
RIGID = 0.1
"""Of a level's motion, what its sensors may read beside one translation and one torsion."""
CLEARLY = 0.5
"""Of what is left without another sensor: if without one no more than this is left, it is the one at fault."""


def unlike_neighbours(record: Record, description: BuildingDescription) -> tuple[Finding, ...]:
    """Channels that do not move as their neighbours do, and levels whose sensors read more than a rigid motion.

    Where two contradict each other and nothing tells which is wrong, both are named. Channels too weak at low
    frequencies are not judged.

    Args:
        record: complete channels about their position at rest, any number for each level and direction.
        description: of the building.
    """
    channels, values = _accelerations(record)
    faults = [fault for rows in _groups(channels) for fault in _outvoted(channels, values, rows, description)]
    findings = [Finding(f.kind, loss(f.channel, description), f.message, f.channel.id, f.value) for f in faults]
    faulty = {fault.channel for fault in faults}
    right = [row for row, channel in enumerate(channels) if channel not in faulty]
    return (*findings, *_not_rigid([channels[row] for row in right], values[right]))


def _accelerations(record: Record) -> tuple[list[Channel], ComplexMatrix]:
    """The horizontal channels that are clear above their noise, and (channels, frequencies) their accelerations."""
    rows = [row for row, channel in enumerate(record.channels) if channel.direction in ("x", "y")]
    channels = [record.channels[row] for row in rows]
    try:
        low = low_spectra(record.samples[rows], record.rate)
    except RecordError:  # too short to know its noise: nothing is concluded
        return [], np.empty((0, 0), dtype=complex)
    accelerations = low.accelerations([channel.quantity for channel in channels])
    kept = [channel for channel, usable in zip(channels, low.clear, strict=True) if usable]
    return kept, accelerations.values[low.clear]


def _groups(channels: Sequence[Channel]) -> Iterator[list[int]]:
    """Rows of the channels that share level, quantity and direction with another."""
    groups: dict[tuple[str, str, str | None], list[int]] = {}
    for row, channel in enumerate(channels):
        groups.setdefault((channel.level, channel.quantity, channel.direction), []).append(row)
    return (rows for rows in groups.values() if len(rows) > 1)


def _outvoted(
    channels: Sequence[Channel], values: ComplexMatrix, rows: Sequence[int], description: BuildingDescription
) -> Iterator[Fault]:
    others = _other_levels(channels, values, channels[rows[0]], description)
    power = _power_of_level(channels, values, channels[rows[0]])
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
    """Power of the level's motion in x and y together, each by the sensor that moves most."""
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
    """What the levels that move as this one say of its motion, None if they say nothing."""

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
    """Levels with more sensors than a rigid motion needs, that do not read one; the one at fault if it can be told."""
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
        told = without[farthest] < CLEARLY * without[next_to_it]
        named = channels[farthest].id if told else None
        yield Finding("neighbour", "warning", message, named, beside)


def _beside_rigid(channels: Sequence[Channel], values: ComplexMatrix, rows: Sequence[int]) -> float:
    """Share of the motion, by root mean square, that no rigid motion explains."""
    design, own = rigid_design([channels[row] for row in rows]), values[list(rows)]
    if design is None or design.shape[0] <= design.shape[1]:
        return 0.0
    residual = own - design @ (np.linalg.pinv(design) @ own)
    return float(np.linalg.norm(residual) / np.linalg.norm(own))
