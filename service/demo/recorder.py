"""What the simulated building's monitoring server records of an earthquake."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from obspy import Trace, UTCDateTime

from core.arrays import Vector
from core.model.simulation import Response
from core.paper import FOURTH_STOREY
from core.record import Direction
from service.demo.catalogue import Earthquake
from service.demo.motions import GroundMotion, prepared
from service.demo.scenario import Scenario
from service.demo.site import BASE, DIRECTIONS, GROUND, RATE, THERMOMETER, Sensor
from service.demo.stiffness_loss import temperature

OFFSET = 50.0  # of the noise: how far a sensor's zero may lie off


def record(earthquake: Earthquake, motion: GroundMotion, scenario: Scenario, seed: int) -> list[Trace]:
    """The counts of every channel; the same earthquake, scenario and seed give the same counts."""
    shaking = prepared(motion, RATE, *scenario.rest)
    shaking *= earthquake.peak / np.abs(shaking).max()
    rng = np.random.default_rng([seed, earthquake.number])
    measured: dict[Direction | None, Mapping[tuple[str, str], Vector]] = {
        direction: _measured(ground, scenario.response(ground, earthquake))
        for direction, ground in zip(DIRECTIONS, shaking, strict=True)
    }
    start = UTCDateTime(earthquake.arrival) - scenario.rest[0]
    noisy = [replace(sensor, noise=scenario.noise * sensor.noise) for sensor in scenario.sensors]
    measured[None] = {(THERMOMETER.level, "temperature"): np.full(shaking.shape[1], temperature(earthquake.arrival))}
    return [_digitized(sensor, measured[sensor.direction], start, rng) for sensor in noisy]


def _measured(ground: Vector, response: Response) -> Mapping[tuple[str, str], Vector]:
    return {
        (GROUND, "acceleration"): ground,
        (BASE, "acceleration"): response.base_acceleration,
        (BASE, "displacement"): response.isolator_displacement,
        ("4F", "acceleration"): response.floor_acceleration[FOURTH_STOREY],
        ("roof", "acceleration"): response.floor_acceleration[-1],
    }


def _digitized(
    sensor: Sensor, measured: Mapping[tuple[str, str], Vector], start: UTCDateTime, rng: np.random.Generator
) -> Trace:
    true = measured[sensor.level, sensor.quantity]
    offset = 0.0 if sensor.quantity == "temperature" else sensor.noise * rng.uniform(-OFFSET, OFFSET)
    sensed = true + offset + sensor.noise * rng.standard_normal(true.size)
    network, station, location, channel = sensor.id.split(".")
    header = {
        "network": network,
        "station": station,
        "location": location,
        "channel": channel,
        "sampling_rate": RATE,
        "starttime": start,
    }
    return Trace(np.round(sensed / sensor.resolution).astype(np.int32), header)
