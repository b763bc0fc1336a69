"""Lateral stiffness of a frame whose joints rotate, on a base slab that rocks."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Tensor, Vector

COLUMN = (
    np.array([[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]]) / 12
)
"""Of the displacements and (times the storey's height) rotations of a prismatic column's two ends, in shares of its
stiffness with both ends clamped."""


@dataclass(frozen=True, slots=True, eq=False)
class LateralStiffness:
    """Stiffness of the floors relative to the base slab's translation, with its derivatives."""

    stiffness: Matrix
    """(floors, floors) N/m."""
    by_storey: Tensor
    """(floors, floors, floors) N/m, first index: derivative by the logarithm of that storey's stiffness."""
    by_joints: Matrix
    """(floors, floors) N/m, derivative by the logarithm of the joints' flexibility."""
    by_rocking: Matrix
    """(floors, floors) N/m, derivative by the logarithm of the rocking flexibility."""
    by_bending: Matrix
    """(floors, floors) N/m, derivative by the logarithm of the bending flexibility."""


def heights(floors: int) -> Vector:
    """(floors,) height of each above the base slab over that of the roof, storeys being alike."""
    return np.arange(1, floors + 1) / floors


def cantilever(floors: int) -> Matrix:
    """(floors, floors) flexibility of a uniform cantilever that bends as a whole, 1 at the roof."""
    low, high = np.minimum.outer(heights(floors), heights(floors)), np.maximum.outer(heights(floors), heights(floors))
    return np.asarray(low**2 * (3 * high - low) / 2)


def lateral_stiffness(storey_stiffness: Vector, joints: float, rocking: float, bending: float) -> LateralStiffness:
    """Frame of alike storeys whose girders clamp the columns' ends in part, in series with a rocking base and with a
    cantilever's bending, as the columns' lengthening and shortening makes it.

    With rigid joints (joints = 0) and no rocking it is the shear building of eq 1; with soft joints it bends as a
    cantilever. The joints' rotations carry no mass and are condensed (Guyan 1965).

    Args:
        storey_stiffness: (floors,) N/m, of the columns below each floor, both ends clamped.
        joints: stiffness of the columns over that of the girders at a joint (the inverse of Blume's joint rotation
            index, 1968), >= 0.
        rocking: deflection of the roof by the base slab's rotation over that by the storeys, both under one
            horizontal force on the roof.
        bending: the same of the bending as a whole.
    """
    frame, by_column, by_joints = _frame(storey_stiffness, max(joints, 1e-9))
    shape = heights(storey_stiffness.size)
    flexibility, bent = linalg.inv(frame), cantilever(storey_stiffness.size)
    storeys = float(np.sum(1 / storey_stiffness))
    K = linalg.inv(flexibility + storeys * (rocking * np.outer(shape, shape) + bending * bent))
    through = K @ flexibility
    by_rocking = -rocking * storeys * np.outer(K @ shape, K @ shape)
    by_bending = -bending * storeys * K @ bent @ K
    share = (1 / storey_stiffness) / storeys
    by_storey = through @ by_column @ through.T - share[:, None, None] * (by_rocking + by_bending)
    return LateralStiffness(K, by_storey, through @ by_joints @ through.T, by_rocking, by_bending)


def _frame(storey_stiffness: Vector, joints: float) -> tuple[Matrix, Tensor, Matrix]:
    """Stiffness on a base that does not rotate, its derivatives by each storey's logarithm and by the joints'."""
    columns, girders = _parts(storey_stiffness.size)
    columns, girders = (storey_stiffness[:, None, None] * parts for parts in (columns, girders / joints))
    moving, rotating = np.split(np.arange(2 * storey_stiffness.size), 2)
    whole = (columns + girders).sum(axis=0)
    kept = np.eye(whole.shape[0], moving.size)
    kept[rotating] = -linalg.solve(whole[rotating][:, rotating], whole[rotating][:, moving], assume_a="pos")
    by_storey = kept.T @ (columns + girders) @ kept
    return by_storey.sum(axis=0), by_storey, -kept.T @ girders.sum(axis=0) @ kept


@cache
def _parts(floors: int) -> tuple[Tensor, Tensor]:
    """(floors, 2 floors, 2 floors) what the columns of each storey, and the girders they size, add to the stiffness of
    translations and rotations, for columns and joints of unit stiffness."""
    columns = np.zeros((floors, 2 * floors + 2, 2 * floors + 2))
    girders = np.zeros_like(columns)
    for storey in range(floors):
        ends = np.array([storey, floors + 1 + storey, storey + 1, floors + 2 + storey])
        columns[storey][np.ix_(ends, ends)] = COLUMN
        # a girder is as stiff as the mean of the columns above and below it; the roof's as its one column
        girders[storey, ends[3], ends[3]] = 1.0 if storey == floors - 1 else 0.5
        girders[storey, ends[1], ends[1]] = 0.5 if storey else 0.0
    free = np.delete(np.arange(2 * floors + 2), [0, floors + 1])
    return columns[:, free][:, :, free], girders[:, free][:, :, free]
