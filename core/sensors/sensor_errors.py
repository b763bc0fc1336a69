"""Differences in gain and clock between sensors, in one event and over all records of a building.

Comparisons determine differences only: the transducer is compared with the accelerations of both sides of the layer,
and the base slab's sensor with the floors' (core.sensors.layer_agreement, core.sensors.floor_agreement). Which of two
sensors errs follows from the fewest errors that explain all differences: that hypothesis has the greatest evidence,
with a narrow prior for sound sensors and a wide one for those that err (spike and slab: Mitchell and Beauchamp, 1988).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.record import Direction, Record
from core.sensors.floor_agreement import floor_agreement
from core.sensors.layer_agreement import LayerAgreement
from core.signals.noise import noise_std

SOUND_STD = np.array([0.01, 1e-3, 2e-5])
"""1, s and s/s: prior standard deviations of gain, delay and rate of delay of a sound sensor. A choice: 1 %, a tenth of
a sample at 100 Hz, 20 ppm."""
ERRING_STD = np.array([0.2, 0.03, 1e-3])
"""The same of a sensor that errs. Not tuned."""
PARTS: Mapping[str, slice] = {"gain": slice(0, 1), "delay": slice(1, 2), "clock": slice(1, 3)}
"""Parts of a sensor that may err. A clock runs at another rate, and is late for that reason."""
DECISIVE = 6.0
"""Log evidence that another error must gain. A choice: odds of 400 to 1."""
UNDECIDED = 3.0
"""Log evidence within which another error is a possible cause too. A choice: odds of 20 to 1."""

Unit = tuple[str, str]
"""A channel's id and one of PARTS."""


@dataclass(frozen=True, slots=True, eq=False)
class SensorDifference:
    """Differences of some channels from a reference: logarithm of the gain, delay in mid-record, rate of delay."""

    channels: tuple[str, ...]
    """Ids."""
    against: str
    """Id of the reference channel."""
    value: Vector
    """(3 channels,) 1, s and s/s, channel by channel."""
    covariance: Matrix
    """(3 channels, 3 channels)."""

    def between(self, channels: Sequence[str]) -> Matrix:
        """(own channels, channels) 1 at a row's channel, −1 at the reference."""
        rows = np.zeros((len(self.channels), len(channels)))
        rows[np.arange(len(self.channels)), [channels.index(name) for name in self.channels]] = 1.0
        rows[:, channels.index(self.against)] = -1.0
        return rows


@dataclass(frozen=True, slots=True)
class SensorHealth:
    """State of one channel in one event."""

    channel: str
    """Id."""
    noise: float | None
    """SI units, standard deviation of its noise in the quietest fifth of the record; None if that is too short."""
    gain: float | None
    """Gain relative to the other sensors of its direction, 1 if they agree; None without a comparison."""
    gain_std: float | None


@dataclass(frozen=True, slots=True, eq=False)
class SensorError:
    """Error of one sensor."""

    channel: str
    """Id."""
    part: str
    """One of PARTS."""
    value: Vector
    """Logarithm of the gain; or delay in mid-record in s; and, for a clock, its rate in s/s."""
    covariance: Matrix
    """Covariance of the value."""
    others: tuple[str, ...]
    """Ids of channels whose error would explain the records as well."""


def sensor_differences(
    record: Record, description: BuildingDescription, direction: Direction, across: LayerAgreement | None
) -> Iterator[SensorDifference]:
    """Base slab and ground compared with the layer's transducer, and the floors with the base slab, where possible.

    Args:
        record: complete channels relative to their position at rest, one per level, quantity and direction.
        description: of the building.
        direction: horizontal.
        across: core.sensors.layer_agreement.recorded_agreement of these.
    """
    differences = {
        (channel.level, channel.quantity): (channel.id, row)
        for channel, row in zip(record.channels, record.samples, strict=True)
        if channel.direction == direction
    }
    base = differences.get((description.base.name, "acceleration"))
    ground, layer = (
        differences.get((description.ground.name, "acceleration")),
        differences.get((description.base.name, "displacement")),
    )
    floors = [
        differences[f.name, "acceleration"] for f in description.floors if (f.name, "acceleration") in differences
    ]
    if base is None:
        return
    if ground is not None and layer is not None and across is not None:
        yield SensorDifference((base[0], ground[0]), layer[0], across.value, across.covariance)
    try:
        if floors:
            above = floor_agreement(base[1], np.array([row for _, row in floors]), record.rate)
            if above is not None:
                yield SensorDifference(tuple(name for name, _ in floors), base[0], above.value, above.covariance)
    except RecordError:  # too short to estimate its noise
        return


def sensor_health(record: Record, differences: Iterable[Sequence[SensorDifference]]) -> tuple[SensorHealth, ...]:
    """Noise and gain of every channel in one event.

    The median gain of a direction counts as right: as long as most sensors are sound, one whose gain has changed
    shows the change and the others do not.

    Args:
        record: complete channels relative to their position at rest, any number per level and direction.
        differences: of each horizontal direction.
    """
    noise, gains = _noise(record), dict[str, tuple[float, float]]()
    for known in differences:
        gains |= dict(_gains(known))
    unknown = (None, None)
    return tuple(
        SensorHealth(channel.id, noise.get(channel.id), *gains.get(channel.id, unknown)) for channel in record.channels
    )


def _noise(record: Record) -> Mapping[str, float]:
    """SI units by channel; empty if the record is too short."""
    try:
        noise = noise_std(record.samples, record.rate)
    except RecordError:
        return {}
    return {channel.id: float(std) for channel, std in zip(record.channels, noise, strict=True)}


def _gains(known: Sequence[SensorDifference]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Gain of each channel and its standard deviation.

    Differences determine the logarithms of the gains up to a constant. The least-squares solution of least norm has a
    mean of zero, and its covariance is that of the difference from the mean; the median then replaces the mean.
    """
    channels = sorted({name for one in known for name in (*one.channels, one.against)})
    if not channels:
        return
    between = np.vstack([one.between(channels) for one in known])
    value = np.concatenate([one.value[::3] for one in known])
    solved = np.linalg.pinv(between)
    covariance = block_diag(*(one.covariance[::3, ::3] for one in known))
    gain = solved @ value
    gain = np.exp(gain - np.median(gain))
    std = gain * np.sqrt(np.diag(solved @ covariance @ solved.T))
    for name, own, own_std in zip(channels, gain, std, strict=True):
        yield name, (float(own), float(own_std))


def sensor_errors(differences: Sequence[SensorDifference]) -> tuple[SensorError, ...]:
    """Sensors whose gain or clock errs, by all records together, the most evident first.

    Args:
        differences: of one direction, of several earthquakes.
    """
    pooled = _pooled(differences)
    erring: list[Unit] = []
    others: list[tuple[str, ...]] = []
    while True:
        tried = {unit: _evidence(pooled, [*erring, unit]) for unit in _units(pooled) if not _overlaps(unit, erring)}
        best = max(tried, key=tried.__getitem__, default=None)
        if best is None or tried[best] < _evidence(pooled, erring) + DECISIVE:
            break
        near = {unit[0] for unit, evidence in tried.items() if evidence > tried[best] - UNDECIDED}
        others.append(tuple(sorted(near - {best[0]})))
        erring.append(best)
    mean, covariance = _posterior(pooled, erring)
    return tuple(
        SensorError(*unit, mean[rows], covariance[np.ix_(rows, rows)], instead)
        for unit, instead in zip(erring, others, strict=True)
        for rows in [pooled.rows([unit])]
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Pooled:
    """Information of all records about the errors of all channels in one direction."""

    channels: tuple[str, ...]
    information: Matrix
    """(3 channels, 3 channels) inverse covariance of gain, delay and rate of each; singular, from differences alone."""
    pull: Vector
    """(3 channels,) information times error."""

    def rows(self, units: Sequence[Unit]) -> list[int]:
        """Indices of the values in which the units may err."""
        starts = [(3 * self.channels.index(channel), PARTS[part]) for channel, part in units]
        return [start + place for start, part in starts for place in range(part.start, part.stop)]


def _pooled(differences: Sequence[SensorDifference]) -> _Pooled:
    channels = tuple(sorted({name for one in differences for name in (*one.channels, one.against)}))
    size = 3 * len(channels)
    information, pull = np.zeros((size, size)), np.zeros(size)
    for one in differences:
        rows = np.kron(one.between(channels), np.eye(3))
        weighted = np.linalg.solve(one.covariance, rows)
        information += rows.T @ weighted
        pull += weighted.T @ one.value
    return _Pooled(channels, information, pull)


def _units(pooled: _Pooled) -> list[Unit]:
    return [(channel, part) for channel in pooled.channels for part in PARTS]


def _overlaps(unit: Unit, erring: Sequence[Unit]) -> bool:
    """True if the unit, or a part of it, is among those that err."""
    own = PARTS[unit[1]]
    return any(
        unit[0] == name and own.stop > PARTS[part].start and own.start < PARTS[part].stop for name, part in erring
    )


def _prior_std(pooled: _Pooled, erring: Sequence[Unit]) -> Vector:
    """(3 channels,) prior standard deviations."""
    std = np.tile(SOUND_STD, len(pooled.channels))
    rows = pooled.rows(erring)
    std[rows] = np.tile(ERRING_STD, len(pooled.channels))[rows]
    return std


def _evidence(pooled: _Pooled, erring: Sequence[Unit]) -> float:
    """Log probability of the records if these err, up to a constant."""
    std = _prior_std(pooled, erring)
    scaled = np.eye(std.size) + pooled.information * np.outer(std, std)
    pull = pooled.pull * std
    return 0.5 * float(pull @ np.linalg.solve(scaled, pull)) - 0.5 * float(np.linalg.slogdet(scaled)[1])


def _posterior(pooled: _Pooled, erring: Sequence[Unit]) -> tuple[Vector, Matrix]:
    std = _prior_std(pooled, erring)
    scaled = np.linalg.inv(np.eye(std.size) + pooled.information * np.outer(std, std))
    covariance = scaled * np.outer(std, std)
    return np.asarray(covariance @ pooled.pull), np.asarray(covariance)
