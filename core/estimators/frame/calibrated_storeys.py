"""What does a calibration say of each storey?"""

import numpy as np

from core.arrays import Matrix, Vector
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.superstructure_model import Design, Layout
from core.estimators.storeys import StoreyStiffness


def storey_stiffness(calibration: Calibration, design: Design, told: Vector) -> StoreyStiffness:
    """As the calibration has it.

    Args:
        calibration: of the superstructure.
        design: that it was calibrated with.
        told: (floors,) N/m, the engineer's, to which the design is in proportion.
    """
    to_storeys = _to_storeys(design.layout)
    scale = np.log(design.storey_stiffness / told)
    return StoreyStiffness(
        np.asarray(scale + to_storeys @ calibration.parameters),
        np.asarray(to_storeys @ calibration.covariance @ to_storeys.T),
        np.asarray((to_storeys * calibration.hypothesis.std**2) @ to_storeys.T),
    )


def _to_storeys(layout: Layout) -> Matrix:
    """(floors, size) by which the parameters make up the logarithms of the storeys' stiffnesses."""
    rows = np.zeros((layout.floors, layout.size))
    rows[:, layout.scale] = 1.0
    rows[:, layout.storeys] = np.tril(np.ones((layout.floors, layout.floors)))
    return rows
