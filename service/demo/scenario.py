"""The demonstrations' buildings, their earthquakes, and the records that their sensors make."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from obspy import Trace, UTCDateTime

from core.arrays import Vector
from core.model.simulation import Response, simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR
from core.record import Direction
from service.demo import hidden_effect, stiffness_loss
from service.demo.earthquakes import STRONG, Earthquake, GroundMotion, Peaks, natural, prepared, weak_then_strong
from service.demo.site import BASE, DIRECTIONS, GROUND, RATE, SENSORS, THERMOMETER, Sensor
from service.demo.stiffness_loss import temperature


@dataclass(frozen=True, slots=True)
class Scenario:
    """A building and what happens to it."""

    response: Callable[[Vector, Earthquake], Response]
    """Of the building in one direction to a ground acceleration, (n,) m/s² at RATE, in an earthquake."""
    earthquakes: int
    """Of the past, unless another number is wanted."""
    peaks: Peaks
    """How strong they are."""
    next_peak: tuple[float, float]
    """m/s², between which an earthquake that is still to come lies."""
    rest: tuple[float, float] = (15.0, 45.0)
    """s that are recorded before the ground moves, and after."""
    noise: float = 1.0
    """Times that of good sensors."""
    motions: tuple[str, ...] = ()
    """Names of the ground motions that they are made of; all there are, where none is named."""
    sensors: tuple[Sensor, ...] = SENSORS

    def chosen(self, motions: Sequence[GroundMotion]) -> tuple[GroundMotion, ...]:
        """Of these ground motions, the scenario's."""
        return tuple(motion for motion in motions if motion.name in self.motions or not self.motions)


def _by_design(ground_acceleration: Vector, _: Earthquake) -> Response:
    return simulate(BUILDING, ISOLATOR, ground_acceleration, RATE)


def _hidden_effect(ground_acceleration: Vector, _: Earthquake) -> Response:
    return hidden_effect.response(ground_acceleration)


SHORT = (  # that move the layer far, and do not last long
    "Northridge 1994, Beverly Hills - Mulhol",
    "Gazli, USSR 1976, Karakyr",
    "Northridge-01 1994, Northridge - Saticoy",
    "Imperial Valley-06 1979, El Centro Array #7",
    "Erzican, Turkey 1992, Erzincan",
    "Northridge-01 1994, Rinaldi Receiving Sta",
    "Kocaeli, Turkey 1999, Izmit",
)

BY_DESIGN = Scenario(_by_design, earthquakes=32, peaks=natural, next_peak=(0.3, 1.0))
"""The layer does what the building file says; the next earthquake is of middling strength, so that it can be seen."""

HIDDEN_EFFECT = Scenario(
    _hidden_effect,
    earthquakes=6,
    peaks=weak_then_strong,
    next_peak=STRONG,
    rest=(10.0, 25.0),
    noise=20.0,  # 0.2 gal, as accelerometers on a chip have it
    motions=SHORT,
)
"""The layer does more than the building file says, which is felt only once it has moved far."""

STIFFNESS_LOSS = Scenario(
    stiffness_loss.response,
    earthquakes=stiffness_loss.LAST_HEALTHY + 8,
    peaks=stiffness_loss.peaks,
    next_peak=(stiffness_loss.WEAK, stiffness_loss.STRONG),
    rest=(10.0, 25.0),
    motions=SHORT,
    sensors=(*SENSORS, THERMOMETER),
)
"""The layer is softer in summer than in winter, and from an earthquake on for good."""


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
