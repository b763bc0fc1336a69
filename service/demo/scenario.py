"""Which building is shaken, and by which earthquakes?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from core.arrays import Vector
from core.model.simulation import Response, simulate
from core.paper import BUILDING, ISOLATOR
from service.demo import hidden_effect, stiffness_loss
from service.demo.catalogue import STRONG, Earthquake, Peaks, natural, weak_then_strong
from service.demo.motions import GroundMotion
from service.demo.site import RATE, SENSORS, THERMOMETER, Sensor


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
