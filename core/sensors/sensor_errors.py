"""Which sensors have a wrong gain or clock, as all records of a building tell together?

Agreements tell differences between sensors only. Which of two errs is told by the fewest errors that explain all
differences: that hypothesis has the greatest evidence, each sensor's error being small by belief unless it is one of
those said to err (spike and slab: Mitchell and Beauchamp, 1988).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.record import Direction, Record
from core.sensors.sensor_differences import SensorDifference, sensor_differences

TYPICAL = np.array([0.01, 1e-3, 2e-5])
"""1, s and s/s: standard deviations of gain, delay and rate of delay of a sensor that is as it should be."""
LARGE = np.array([0.2, 0.03, 1e-3])
"""The same of one that errs."""
PARTS: Mapping[str, slice] = {"gain": slice(0, 1), "delay": slice(1, 2), "clock": slice(1, 3)}
"""What may err of a sensor: a clock runs at another rate, and is late therefore."""
DECISIVE = 6.0
"""Of log evidence, that an error more must bring."""
UNDECIDED = 3.0
"""Of log evidence: another error that explains as much within it may be the cause as well."""

Unit = tuple[str, str]
"""A channel's id and one of PARTS."""


@dataclass(frozen=True, slots=True, eq=False)
class SensorError:
    """One sensor's error."""

    channel: str
    """Id."""
    part: str
    """One of PARTS."""
    value: Vector
    """Logarithm of the gain; or delay at a record's middle in s; and, of a clock, its rate in s/s."""
    covariance: Matrix
    """Of the value."""
    others: tuple[str, ...]
    """Ids of channels whose error would explain as much in its place."""


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """What the records say of the errors of all channels in one direction."""

    channels: tuple[str, ...]
    information: Matrix
    """(3 channels, 3 channels) inverse covariance of gain, delay and rate of each; differences are known only."""
    pull: Vector
    """(3 channels,) information times error."""

    def rows(self, units: Sequence[Unit]) -> list[int]:
        """Places of what the units may err by."""
        starts = [(3 * self.channels.index(channel), PARTS[part]) for channel, part in units]
        return [start + place for start, part in starts for place in range(part.start, part.stop)]


def sensor_errors(
    records: Sequence[Record], description: BuildingDescription, direction: Direction
) -> tuple[SensorError, ...]:
    """Gains and clocks of sensors that are not as they should be, the most evident first.

    Args:
        records: of several earthquakes, each with complete channels about their position at rest.
        description: of the building.
        direction: horizontal.
    """
    differences = [found for record in records for found in sensor_differences(record, description, direction)]
    known = _gathered(differences)
    erring: list[Unit] = []
    others: list[tuple[str, ...]] = []
    while True:
        tried = {unit: _evidence(known, [*erring, unit]) for unit in _units(known) if not _overlaps(unit, erring)}
        best = max(tried, key=tried.__getitem__, default=None)
        if best is None or tried[best] < _evidence(known, erring) + DECISIVE:
            break
        near = {unit[0] for unit, evidence in tried.items() if evidence > tried[best] - UNDECIDED}
        others.append(tuple(sorted(near - {best[0]})))
        erring.append(best)
    mean, covariance = _posterior(known, erring)
    return tuple(
        SensorError(*unit, mean[rows], covariance[np.ix_(rows, rows)], instead)
        for unit, instead in zip(erring, others, strict=True)
        for rows in [known.rows([unit])]
    )


def _gathered(differences: Sequence[SensorDifference]) -> _Known:
    channels = tuple(sorted({name for one in differences for name in (*one.channels, one.against)}))
    size = 3 * len(channels)
    information, pull = np.zeros((size, size)), np.zeros(size)
    for one in differences:
        rows = np.kron(one.between(channels), np.eye(3))
        weighted = np.linalg.solve(one.covariance, rows)
        information += rows.T @ weighted
        pull += weighted.T @ one.value
    return _Known(channels, information, pull)


def _units(known: _Known) -> list[Unit]:
    return [(channel, part) for channel in known.channels for part in PARTS]


def _overlaps(unit: Unit, erring: Sequence[Unit]) -> bool:
    """Whether the unit, or a part of it, is among those that err."""
    own = PARTS[unit[1]]
    return any(
        unit[0] == name and own.stop > PARTS[part].start and own.start < PARTS[part].stop for name, part in erring
    )


def _believed(known: _Known, erring: Sequence[Unit]) -> Vector:
    """(3 channels,) standard deviations."""
    std = np.tile(TYPICAL, len(known.channels))
    rows = known.rows(erring)
    std[rows] = np.tile(LARGE, len(known.channels))[rows]
    return std


def _evidence(known: _Known, erring: Sequence[Unit]) -> float:
    """Log probability of the records if these err, up to a constant."""
    std = _believed(known, erring)
    scaled = np.eye(std.size) + known.information * np.outer(std, std)
    pull = known.pull * std
    return 0.5 * float(pull @ np.linalg.solve(scaled, pull)) - 0.5 * float(np.linalg.slogdet(scaled)[1])


def _posterior(known: _Known, erring: Sequence[Unit]) -> tuple[Vector, Matrix]:
    std = _believed(known, erring)
    scaled = np.linalg.inv(np.eye(std.size) + known.information * np.outer(std, std))
    covariance = scaled * np.outer(std, std)
    return np.asarray(covariance @ known.pull), np.asarray(covariance)
