"""By how much do the sensors of one record differ in gain and clock?"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.record import Direction, Record
from core.sensors.floor_agreement import floor_agreement
from core.sensors.layer_agreement import layer_agreement


@dataclass(frozen=True, slots=True, eq=False)
class SensorDifference:
    """Of some channels against another one: logarithm of the gain, delay at the record's middle, rate of delay."""

    channels: tuple[str, ...]
    """Ids."""
    against: str
    """Id of the channel that they are held against."""
    value: Vector
    """(3 channels,) 1, s and s/s, channel by channel."""
    covariance: Matrix
    """(3 channels, 3 channels)."""

    def between(self, channels: Sequence[str]) -> Matrix:
        """(own channels, channels) 1 where a row's channel stands, -1 where the other one does."""
        rows = np.zeros((len(self.channels), len(channels)))
        rows[np.arange(len(self.channels)), [channels.index(name) for name in self.channels]] = 1.0
        rows[:, channels.index(self.against)] = -1.0
        return rows


def sensor_differences(
    record: Record, description: BuildingDescription, direction: Direction
) -> Iterator[SensorDifference]:
    """Base slab and ground against the layer's transducer, and the floors against the base slab; as far as known.

    Args:
        record: complete channels about their position at rest, one for each level, quantity and direction.
        description: of the building.
        direction: horizontal.
    """
    found = {
        (channel.level, channel.quantity): (channel.id, row)
        for channel, row in zip(record.channels, record.samples, strict=True)
        if channel.direction == direction
    }
    base = found.get((description.base.name, "acceleration"))
    ground, layer = (
        found.get((description.ground.name, "acceleration")),
        found.get((description.base.name, "displacement")),
    )
    floors = [found[f.name, "acceleration"] for f in description.floors if (f.name, "acceleration") in found]
    if base is None:
        return
    try:
        if ground is not None and layer is not None:
            across = layer_agreement(layer[1], base[1], ground[1], record.rate)
            if across is not None:
                yield SensorDifference((base[0], ground[0]), layer[0], across.value, across.covariance)
        if floors:
            above = floor_agreement(base[1], np.array([row for _, row in floors]), record.rate)
            if above is not None:
                yield SensorDifference(tuple(name for name, _ in floors), base[0], above.value, above.covariance)
    except RecordError:  # too short to know its noise: nothing is concluded
        return
