"""What is free to be found, and what is believed of it before any record?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Vector


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """Which parameters a calibration is free to choose, and what is believed of them before."""

    name: str
    mean: Vector
    """(size,)"""
    std: Vector
    """(size,) 0 where a parameter is held."""
    is_random: bool
    """Whether the base slab rocks and the floors move beyond what the model says."""

    @property
    def free(self) -> Indices:
        """Parameters that are not held."""
        return np.flatnonzero(self.std > 0)

    def penalty(self, parameters: Vector) -> float:
        """Of the prior, in units of a negative log likelihood."""
        free = self.free
        return 0.5 * float(np.sum(((parameters - self.mean)[free] / self.std[free]) ** 2))
