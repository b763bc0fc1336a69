"""The demonstrations' buildings, their earthquakes, and their sensors' records."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from obspy import Trace, UTCDateTime

from core.arrays import Vector
from core.model.simulation import Response, simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR
from core.record import Direction
from service.demo import hidden_effect, stiffness_loss
from service.demo.earthquakes import (
    STRONG,
    Earthquake,
    GroundMotion,
    Peaks,
    natural,
    prepared,
    weak_then_strong,
)
from service.demo.site import BASE, DIRECTIONS, GROUND, RATE, SENSORS, THERMOMETER, Sensor
from service.demo.stiffness_loss import temperature


@dataclass(frozen=True, slots=True)
class Scenario:
    """A building and its earthquakes."""

    response: Callable[[Vector, Earthquake], Response]
    """Response in one direction to (n,) m/s² ground acceleration at RATE in an earthquake."""
    earthquakes: int
    """Number of past earthquakes, unless another number is given."""
    peaks: Peaks
    """Distribution of peak accelerations."""
    next_peak: tuple[float, float]
    """m/s², range of the next earthquake's peak acceleration."""
    rest: tuple[float, float] = (15.0, 45.0)
    """s recorded before and after the motion."""
    noise: float = 1.0
    """Factor on the noise of good sensors."""
    motions: tuple[str, ...] = ()
    """Names of the ground motions to use; all available ones if empty."""
    sensors: tuple[Sensor, ...] = SENSORS

    def chosen(self, motions: Sequence[GroundMotion]) -> tuple[GroundMotion, ...]:
        """The scenario's selection of these ground motions."""
        return tuple(motion for motion in motions if motion.name in self.motions or not self.motions)


def _by_design(ground_acceleration: Vector, _: Earthquake) -> Response:
    return simulate(BUILDING, ISOLATOR, ground_acceleration, RATE)


def _hidden_effect(ground_acceleration: Vector, _: Earthquake) -> Response:
    return hidden_effect.response(ground_acceleration)


SHORT = (  # motions that move the layer far and are short
    "Northridge 1994, Beverly Hills - Mulhol",
    "Gazli, USSR 1976, Karakyr",
    "Northridge-01 1994, Northridge - Saticoy",
    "Imperial Valley-06 1979, El Centro Array #7",
    "Erzican, Turkey 1992, Erzincan",
    "Northridge-01 1994, Rinaldi Receiving Sta",
    "Kocaeli, Turkey 1999, Izmit",
)

BY_DESIGN = Scenario(_by_design, earthquakes=48, peaks=natural, next_peak=(0.3, 1.0))
"""The layer follows the building file; the next earthquake is moderate, so that it is visible."""

HIDDEN_EFFECT = Scenario(
    _hidden_effect,
    earthquakes=6,
    peaks=weak_then_strong,
    next_peak=STRONG,
    rest=(10.0, 25.0),
    noise=20.0,  # 0.2 gal, as MEMS accelerometers have
    motions=SHORT,
)
"""The layer differs from the building file, which shows only after large displacements."""

STIFFNESS_LOSS = Scenario(
    stiffness_loss.response,
    earthquakes=stiffness_loss.LAST_HEALTHY + 8,
    peaks=stiffness_loss.peaks,
    next_peak=(stiffness_loss.WEAK, stiffness_loss.STRONG),
    rest=(10.0, 25.0),
    motions=SHORT,
    sensors=(*SENSORS, THERMOMETER),
)
"""The layer is softer in summer than in winter, and permanently softer after one earthquake."""


OFFSET = 50.0  # in units of the noise: offset of a sensor's zero


def record(earthquake: Earthquake, motion: GroundMotion, scenario: Scenario, seed: int) -> list[Trace]:
    """Counts of every channel; equal arguments give equal counts."""
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
