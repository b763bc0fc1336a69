"""How does each sensor do in one event: how loud is it at rest, and how does its gain stand to the others'?

Sensors tell each other's gain, none tells its own: with the transducer, the accelerations of both sides of the layer,
and with the base slab's, those of the floors (core.sensors.sensor_differences). Of all in a direction the median is
taken for right, so that one whose gain has changed shows the change and the others do not, as long as most are sound.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from core.description import BuildingDescription
from core.errors import RecordError
from core.record import Direction, Record
from core.sensors.sensor_differences import sensor_differences
from core.signals.noise import noise_std


@dataclass(frozen=True, slots=True)
class SensorHealth:
    """One channel in one event."""

    channel: str
    """Id."""
    noise: float | None
    """SI units, standard deviation of its noise in the quietest fifth of the record; None where that is too short."""
    gain: float | None
    """Over that of the other sensors of its direction, 1 if they agree; None where nothing tells it."""
    gain_std: float | None


def sensor_health(record: Record, levels: Record, description: BuildingDescription) -> tuple[SensorHealth, ...]:
    """Noise and gain of every channel.

    Args:
        record: complete channels about their position at rest, any number for each level and direction.
        levels: the same, one for each level, quantity and direction.
        description: of the building.
    """
    noise, gains = _noise(record), dict[str, tuple[float, float]]()
    for direction in description.horizontal_directions:
        gains |= dict(_gains(levels, description, direction))
    unknown = (None, None)
    return tuple(
        SensorHealth(channel.id, noise.get(channel.id), *gains.get(channel.id, unknown)) for channel in record.channels
    )


def _noise(record: Record) -> Mapping[str, float]:
    """SI units by channel; empty where the record is too short to know it."""
    try:
        found = noise_std(record.samples, record.rate)
    except RecordError:
        return {}
    return {channel.id: float(std) for channel, std in zip(record.channels, found, strict=True)}


def _gains(
    record: Record, description: BuildingDescription, direction: Direction
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Each channel's gain and its standard deviation.

    The differences between logarithms of gains determine these up to a constant: the least squares solution of least
    norm has a mean of zero, and its covariance is that of the distance from the mean. The median is put for the mean.
    """
    known = list(sensor_differences(record, description, direction))
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
