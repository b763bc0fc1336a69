"""How stiff is each storey against its design, as one record tells it?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector


@dataclass(frozen=True, slots=True, eq=False)
class StoreyStiffness:
    """Of every storey, from the lowest floor's to the roof's."""

    deviation: Vector
    """(floors,) logarithm of the stiffness over the design's."""
    covariance: Matrix
    """(floors, floors) with the record."""
    believed: Matrix
    """(floors, floors) without it: of the prior, whose mean is the design but for a scale that nobody knows."""

    @property
    def information(self) -> Matrix:
        """(floors, floors) what the record alone adds, an inverse covariance; 0 where it says nothing."""
        scale = np.sqrt(np.diag(self.covariance))
        gained = np.linalg.inv(self.covariance) - np.linalg.inv(self.believed)
        values, vectors = np.linalg.eigh(gained * np.outer(scale, scale))
        return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T / np.outer(scale, scale))

    @property
    def pull(self) -> Vector:
        """(floors,) information times the deviation that the record alone would tell."""
        return np.asarray(np.linalg.solve(self.covariance, self.deviation))
