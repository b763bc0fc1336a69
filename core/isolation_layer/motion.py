"""How did the isolation layer move, and how well is that known?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Vector


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion of the isolation layer: of the base slab relative to the ground; of a torsion in rad and rad/s."""

    displacement: Vector
    """(n,) m."""
    velocity: Vector
    """(n,) m/s."""


@dataclass(frozen=True, slots=True)
class ResidualDisplacement:
    """How far from its first position at rest the layer came to rest."""

    value: float
    """m, mean of the record's end less mean of its start."""
    std: float
    """m, standard deviation: of the noise, and of the rest that was not yet reached."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredMotion(Motion):
    """A motion as sensors tell it."""

    displacement_std: Vector
    """(n,) m, standard deviation of the displacement."""
    velocity_std: Vector
    """(n,) m/s, standard deviation of the velocity."""
    band: tuple[float, float]
    """Hz, for which the motion is good; from 0 where a transducer measured it."""
    noise: float
    """m, standard deviation of the displacement's white noise and drift, without what the sensors could not follow."""
    residual: ResidualDisplacement | None = None
    """None where no transducer measured it: an integral knows none."""
    noise_std: tuple[Vector, Vector] | None = None
    """(n,) m and m/s, the deviations without the slow motion that an integral lacks and without what noise hides of the
    position at rest: models are fitted by them. None: `displacement_std` and `velocity_std`."""

    @property
    def fitting_std(self) -> tuple[Vector, Vector]:
        """(n,) m and m/s, standard deviations of displacement and velocity by which models are fitted."""
        return self.noise_std or (self.displacement_std, self.velocity_std)

    @property
    def is_integrated(self) -> bool:
        """Whether it comes from accelerations alone, so that whatever is slower than its band is not in it."""
        return self.band[0] > 0

    @property
    def peak(self) -> tuple[float, float]:
        """m, largest absolute displacement, and its standard deviation."""
        at = int(np.argmax(np.abs(self.displacement)))
        return float(abs(self.displacement[at])), float(self.displacement_std[at])
