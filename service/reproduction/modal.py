"""What are the accelerations of the modes that the paper's method identifies?"""

from core.arrays import Matrix
from core.estimators import cms
from core.estimators.result import RestoringForce
from core.estimators.substructure import modal_acceleration
from core.estimators.superstructure import InstrumentedSuperstructure
from core.identification.modes import mass_normalised

MODES = 2
"""Modes that the paper shows, at most."""


def identified_shapes(superstructure: InstrumentedSuperstructure, force: RestoringForce) -> Matrix:
    """(floors, MODES or fewer) kg^(-1/2), expanded and mass-normalised."""
    shapes = cms.shape_matrix(force.modes[:MODES], superstructure.floor_mass.size)
    return mass_normalised(shapes, superstructure.floor_mass)


def modal_accelerations(superstructure: InstrumentedSuperstructure, shapes: Matrix) -> Matrix:
    """(modes, n) m/s² kg^(1/2), of the motion relative to the base slab (eq 23)."""
    relative = superstructure.floor_acceleration - superstructure.base_acceleration
    return modal_acceleration(shapes, superstructure.measured, relative)
