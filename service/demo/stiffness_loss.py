"""A building whose isolators lose 8 % of their stiffness in an earthquake, and soften in summer.

The service gets the records of its sensors, a thermometer among them.
"""

from datetime import UTC, datetime

import numpy as np

from core.arrays import Vector
from core.effects import EFFECTS
from core.model.isolator import Isolator
from core.model.simulation import Response, simulate
from core.paper import BUILDING, ISOLATOR
from service.demo.earthquakes import Earthquake
from service.demo.site import RATE

LOSS = 0.08
"""Fraction of the rubber's stiffness and the dampers' yield force lost after earthquake LAST_HEALTHY."""
SOFTENED = ("N/m", "N")
"""Units of the parameters that change, stiffness and yield force; viscous ones do not."""
LAST_HEALTHY = 24
"""Number of healthy earthquakes, the last of which does the damage: a few more than a baseline needs."""
WEAK, STRONG = 0.5, 1.6
"""m/s², range of the earthquakes; the damaging one is no stronger than the others."""
PER_KELVIN = -0.004
"""1/K, relative change of the rubber's stiffness, usual for natural rubber."""
MEAN, SWING, WARMEST = 16.0, 10.0, 217
"""°C and day of the year, approximately those of Yokohama."""
REFERENCE = 15.0
"""°C, at which the layer has its design stiffness."""


def response(ground_acceleration: Vector, earthquake: Earthquake) -> Response:
    """Error-free records, from rest.

    Args:
        ground_acceleration: (n,) m/s² at RATE.
        earthquake: which one; its time says how warm the rubber is.
    """
    return simulate(BUILDING, layer(earthquake), ground_acceleration, RATE)


def layer(earthquake: Earthquake) -> Isolator:
    """The isolation layer in an earthquake."""
    left = 1 - LOSS if earthquake.number >= LAST_HEALTHY else 1.0
    factor = left * float(np.exp(PER_KELVIN * (temperature(earthquake.arrival) - REFERENCE)))
    return Isolator(
        {
            name: {
                one.name: values[one.name] * (factor if one.unit in SOFTENED else 1) for one in EFFECTS[name].parameters
            }
            for name, values in ISOLATOR.effects.items()
        }
    )


def temperature(moment: datetime) -> float:
    """°C of the rubber, at an aware time, by season."""
    day = moment.astimezone(UTC).timetuple().tm_yday
    return float(MEAN + SWING * np.cos(2 * np.pi * (day - WARMEST) / 365.25))


def peaks(count: int, rng: np.random.Generator) -> Vector:
    """(count,) m/s² in random order, except that one of the strongest does the damage."""
    peaks = rng.permutation(np.geomspace(WEAK, STRONG, count))
    if count >= LAST_HEALTHY:
        strongest = int(peaks.argmax())
        peaks[[strongest, LAST_HEALTHY - 1]] = peaks[[LAST_HEALTHY - 1, strongest]]
    return np.asarray(peaks)
