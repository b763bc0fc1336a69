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
"""Of the rubber's stiffness and the dampers' yield force, from the earthquake after LAST_HEALTHY on."""
SOFTENED = ("N/m", "N")
"""Units of the stiffness and of the yield force, which rubber loses; what is viscous stays."""
LAST_HEALTHY = 24
"""Earthquakes, the last of which does the damage; as many as a baseline wants, and some more."""
WEAK, STRONG = 0.5, 1.6
"""m/s², between which the earthquakes lie: the one that does the damage is as strong as any, and not stronger."""
PER_KELVIN = -0.004
"""By how much rubber softens with each kelvin: of the usual size for natural rubber."""
MEAN, SWING, WARMEST = 16.0, 10.0, 217
"""°C and day of the year, of Yokohama about."""
REFERENCE = 15.0
"""°C, at which the layer is as designed."""


def response(ground_acceleration: Vector, earthquake: Earthquake) -> Response:
    """What sensors without error would record, from rest.

    Args:
        ground_acceleration: (n,) m/s² at RATE.
        earthquake: which one; its time says how warm the rubber is.
    """
    return simulate(BUILDING, layer(earthquake), ground_acceleration, RATE)


def layer(earthquake: Earthquake) -> Isolator:
    """The isolation layer as it is in an earthquake."""
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
    """°C of the rubber, at an aware time: it follows the season."""
    day = moment.astimezone(UTC).timetuple().tm_yday
    return float(MEAN + SWING * np.cos(2 * np.pi * (day - WARMEST) / 365.25))


def peaks(count: int, rng: np.random.Generator) -> Vector:
    """(count,) m/s²: as many of every strength, in any order, but one of the strongest does the damage."""
    found = rng.permutation(np.geomspace(WEAK, STRONG, count))
    if count >= LAST_HEALTHY:
        strongest = int(found.argmax())
        found[[strongest, LAST_HEALTHY - 1]] = found[[LAST_HEALTHY - 1, strongest]]
    return np.asarray(found)
