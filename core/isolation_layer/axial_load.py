"""How does the isolators' vertical load change while the building moves up and down?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription
from core.quality import Finding
from core.record import Record
from core.signals.conditioning import band_passed

GRAVITY = 9.80665
"""m/s², standard."""


@dataclass(frozen=True, slots=True, eq=False)
class AxialLoad:
    """The vertical force on all isolators together."""

    ratio: Vector
    """(n,) N/W, vertical force over weight: 1 at rest, below 0 in uplift."""
    level: str
    """Name of the level whose vertical acceleration it is from."""


def axial_load(
    record: Record, description: BuildingDescription, band: tuple[float, float]
) -> tuple[AxialLoad | None, tuple[Finding, ...]]:
    """N/W = 1 + a_z/g of the building as one mass; a_z is the base slab's, else the lowest floor's, else the ground's.

    Args:
        record: complete channels about their position at rest, one for each level, quantity and direction; z upwards.
        description: of the building.
        band: Hz, pass band.

    Returns:
        None where nothing measures a vertical acceleration; a note where it is not that of the base slab.
    """
    levels = (description.base, *description.floors, description.ground)
    for level in levels:
        vertical = record.find(level.name, "acceleration", "z")
        if vertical is None:
            continue
        load = AxialLoad(np.asarray(1 + band_passed(vertical, record.rate, band) / GRAVITY), level.name)
        if level is description.base:
            return load, ()
        message = f"the vertical load is from the acceleration of level {level.name!r}, for want of the base slab's"
        return load, (Finding("axial_load", "note", message),)
    return None, ()
