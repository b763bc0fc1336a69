"""What is known of a building's superstructure, to predict its motion from the ground's?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.building import FixedBaseModes, ShearBuilding, fixed_base_modes
from core.description import BuildingDescription
from core.errors import IdentificationError
from core.estimators.estimator import RestoringForce
from core.estimators.expansion import assumed_stiffness

USUAL_DAMPING = 0.02
"""Ratio of the first mode of a building of which no record tells one."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownSuperstructure:
    """The superstructure in one direction."""

    modes: FixedBaseModes
    """All of them."""
    source: str
    """Where they are from, in words."""


def known_superstructure(forces: Sequence[RestoringForce], description: BuildingDescription) -> KnownSuperstructure:
    """The best that records and design give in one direction.

    That is the superstructure calibrated from the record with the strongest motion; without one, a shear building of
    the design's storeys (or the paper's, proportional to the floors' masses) scaled to the lowest identified mode;
    without one, the design as it is.

    Args:
        forces: estimated in the records, in this direction.
        description: of the building.

    Raises:
        IdentificationError: neither records nor design tell of it.
    """
    calibrated = [(float(np.std(force.force)), force.superstructure) for force in forces if force.superstructure]
    if calibrated:
        _, modes = max(calibrated, key=lambda pair: pair[0])
        return KnownSuperstructure(
            modes, "the superstructure is that calibrated from the record of the strongest motion"
        )
    lowest = [force.modes[0] for force in forces if force.modes]
    if lowest:
        frequency = float(np.median([mode.frequency for mode in lowest]))
        damping = float(np.median([mode.damping_ratio for mode in lowest]))
        source = f"the superstructure is {_storeys(description)} with the identified first mode, {frequency:.3g} Hz"
        return KnownSuperstructure(_scaled(description, frequency, damping), source)
    if description.storey_stiffness is None:
        raise IdentificationError(
            "no mode was identified in any record, and the design gives no storey stiffness; that of "
            "every storey in the building file would do"
        )
    design = _shear(description, description.storey_stiffness, USUAL_DAMPING)
    return KnownSuperstructure(design, "the superstructure is the design's; no record told of it")


def _storeys(description: BuildingDescription) -> str:
    if description.storey_stiffness is None:
        return "a shear building of storeys as stiff as the floor above is heavy"
    return "the design's shear building"


def _scaled(description: BuildingDescription, frequency: float, damping: float) -> FixedBaseModes:
    given = description.storey_stiffness
    storeys = assumed_stiffness(description.floor_mass) if given is None else given
    first = _shear(description, storeys, damping).frequency[0]
    return _shear(description, storeys * (frequency / first) ** 2, damping)


def _shear(description: BuildingDescription, storeys: Vector, damping: float) -> FixedBaseModes:
    """Of a shear building damped in proportion to its stiffness, with this ratio in its first mode."""
    undamped = fixed_base_modes(ShearBuilding(description.base_mass, description.floor_mass, storeys, 0.0))
    coefficient = 2 * damping / float(undamped.angular_frequency[0])
    return fixed_base_modes(ShearBuilding(description.base_mass, description.floor_mass, storeys, coefficient))
