"""Motion of the isolation layer, and its uncertainty."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from core.arrays import Vector

Integral = Literal["recorded", "restored"]
"""Motion from a displacement channel that was integrated from accelerations: as recorded, or with the slow motion
restored that its high-pass removed."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion of the base slab relative to the ground; for a torsion, in rad and rad/s."""

    displacement: Vector
    """(n,) m."""
    velocity: Vector
    """(n,) m/s."""


@dataclass(frozen=True, slots=True)
class ResidualDisplacement:
    """Displacement of the layer's position at rest by an earthquake."""

    value: float
    """m, mean of the record's end less mean of its start."""
    std: float
    """m, standard deviation: noise, and motion that had not ended."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredMotion(Motion):
    """Motion estimated from sensors."""

    displacement_std: Vector
    """(n,) m, standard deviation of the displacement."""
    velocity_std: Vector
    """(n,) m/s, standard deviation of the velocity."""
    band: tuple[float, float]
    """Hz, within which the motion is valid; from 0 where a transducer measured it."""
    noise: float
    """m, standard deviation of the displacement's white noise and drift, without motion that the sensors missed."""
    residual: ResidualDisplacement | None = None
    """None without a transducer: an integral does not show it."""
    noise_std: tuple[Vector, Vector] | None = None
    """(n,) m and m/s, standard deviations for fitting models: without the slow motion that an integral misses, and
    without the uncertainty of a position at rest that noise hides. None: `displacement_std` and `velocity_std`."""
    is_restored: bool = False
    """True if slow motion was restored to it that a high-pass had removed."""

    @property
    def fitting_std(self) -> tuple[Vector, Vector]:
        """(n,) m and m/s, standard deviations of displacement and velocity for fitting models."""
        return self.noise_std or (self.displacement_std, self.velocity_std)

    @property
    def is_integrated(self) -> bool:
        """True if it comes from accelerations alone, so that it lacks all that is slower than its band."""
        return self.band[0] > 0

    @property
    def peak(self) -> tuple[float, float]:
        """m, largest absolute displacement, and its standard deviation."""
        at = int(np.argmax(np.abs(self.displacement)))
        return float(abs(self.displacement[at])), float(self.displacement_std[at])
