"""Records of the described building whose sensors agree except for given errors."""

from collections.abc import Mapping, Sequence

import consistent_sensors
import numpy as np
from building_models import BASE, FOURTH, GROUND, LAYER, ROOF, paper
from consistent_sensors import RATE
from paper_records import START

from core.arrays import Vector
from core.record import Direction, Record
from core.sensors.layer_agreement import recorded_agreement
from core.sensors.sensor_errors import SensorDifference, sensor_differences

ROWS = (GROUND, BASE, FOURTH, ROOF, LAYER)


def consistent_record(
    errors: Mapping[str, Vector], noise: float, seed: Sequence[int], without: Sequence[str] = ()
) -> Record:
    """One earthquake.

    Args:
        errors: (3,) logarithm of gain, delay and rate of delay, by channel.
        noise: of each accelerometer, over its root mean square.
        seed: of motion and noise.
        without: channels that are not there.
    """
    samples = consistent_sensors.one_earthquake(np.random.default_rng(seed), noise)
    for name, error in errors.items():
        samples[ROWS.index(name)] = consistent_sensors.with_errors(samples[ROWS.index(name)], error)
    kept = [row for row, name in enumerate(ROWS) if name not in without]
    channels = tuple(next(c for c in paper().channels if c.id == ROWS[row]) for row in kept)
    return Record(START, RATE, channels, samples[kept])


def differences(record: Record) -> dict[Direction, tuple[SensorDifference, ...]]:
    """Differences between the sensors of the described building, as an analysis keeps them."""
    return {
        name: tuple(sensor_differences(record, paper(), name, recorded_agreement(record, paper(), name)))
        for name in paper().horizontal_directions
    }
