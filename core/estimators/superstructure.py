"""The superstructure as an estimator sees it, and the best knowledge of it for predicting its motion."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Matrix, Vector
from core.building import FixedBaseModes, ShearBuilding, fixed_base_modes
from core.description import BuildingDescription
from core.errors import IdentificationError, ModelError, RecordError
from core.estimators.result import RestoringForce
from core.estimators.substructure import assumed_stiffness
from core.record import Direction, Record
from core.signals.conditioning import band_passed

USUAL_DAMPING = 0.02
"""Damping ratio of the first mode of a building without any identified one. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class InstrumentedSuperstructure:
    """The superstructure in one direction with the accelerations measured in it: all that an estimator may use."""

    rate: float
    """Hz."""
    base_acceleration: Vector
    """(n,) m/s², absolute, of the base slab."""
    floor_acceleration: Matrix
    """(measured, n) m/s², absolute, of the instrumented floors from the lowest to the roof."""
    measured: Indices
    """(measured,) indices of these floors, 0 for the lowest floor above the base slab."""
    base_mass: float
    """kg."""
    floor_mass: Vector
    """(floors,) kg, from the lowest floor to the roof."""
    storey_stiffness: Vector | None = None
    """(floors,) N/m, or None: then proportional to the mass of the floor above (paper, section 5)."""


def check(superstructure: InstrumentedSuperstructure) -> None:
    """Raises an error for input that no estimator can use.

    Raises:
        RecordError: the record holds gaps, or its shape does not fit the measured floors.
        ModelError: a mass is not positive.
    """
    base, floors, measured = (
        superstructure.base_acceleration,
        superstructure.floor_acceleration,
        superstructure.measured,
    )
    if floors.shape != (measured.size, base.size):
        raise RecordError(
            f"floor accelerations of shape {floors.shape} do not fit "
            f"{measured.size} measured floors of {base.size} samples"
        )
    if not (np.isfinite(base).all() and np.isfinite(floors).all()):
        raise RecordError("accelerations have gaps (NaN); give a record without gaps, or without that channel")
    if not (superstructure.base_mass > 0 and np.all(superstructure.floor_mass > 0)):
        raise ModelError("every mass must be positive")


def instrumented_superstructure(
    record: Record,
    description: BuildingDescription,
    direction: Direction,
    sensors: Collection[str] | None,
    band: tuple[float, float],
) -> InstrumentedSuperstructure:
    """The band-passed accelerations of the chosen levels in one direction.

    Args:
        record: complete channels about their position at rest.
        description: of the building.
        direction: horizontal.
        sensors: names of the levels, the base slab (also as `base`) among them; None: every instrumented one.
        band: Hz, pass band.

    Raises:
        ModelError: a level is not known, or the base slab is left out.
        RecordError: the base slab's acceleration, or that of every floor, is not in the record.
    """
    chosen = _chosen_levels(description, sensors)
    base = record.find(description.base.name, "acceleration", direction)
    if base is None:
        raise RecordError("the base slab's acceleration cannot be used; nothing can be estimated without it")
    floors = {
        index: samples
        for index, level in enumerate(description.floors)
        if level.name in chosen and (samples := record.find(level.name, "acceleration", direction)) is not None
    }
    if not floors:
        raise RecordError("no floor above the base slab was recorded; at least one is needed, preferably the roof")
    accelerations = band_passed(np.array([base, *floors.values()]), record.rate, band)
    return InstrumentedSuperstructure(
        rate=record.rate,
        base_acceleration=accelerations[0],
        floor_acceleration=accelerations[1:],
        measured=np.array(list(floors), dtype=np.intp),
        base_mass=description.base_mass,
        floor_mass=description.floor_mass,
        storey_stiffness=description.storey_stiffness,
    )


def _chosen_levels(description: BuildingDescription, sensors: Collection[str] | None) -> set[str]:
    names = [level.name for level in description.levels]
    chosen = set(names if sensors is None else sensors)
    aliases = {"base": description.base.name}
    chosen = {aliases.get(name, name) if name not in names else name for name in chosen}
    if unknown := sorted(chosen - set(names)):
        raise ModelError(f"no level is called {unknown}; there are {names}")
    if description.base.name not in chosen:
        raise ModelError(f"the sensors {sorted(chosen)} leave out the base slab, {description.base.name!r}; add it")
    return chosen


@dataclass(frozen=True, slots=True, eq=False)
class KnownSuperstructure:
    """The superstructure's modes in one direction."""

    modes: FixedBaseModes
    """All of them."""
    source: str
    """Their source, in words."""


def known_superstructure(forces: Sequence[RestoringForce], description: BuildingDescription) -> KnownSuperstructure:
    """The best knowledge of the superstructure in one direction.

    It is the superstructure calibrated from the record with the strongest motion; without one, a shear building of
    the design's storeys (or the paper's, proportional to the floors' masses) scaled to the lowest identified mode;
    without one, the design as it is.

    Args:
        forces: estimated in the records, in this direction.
        description: of the building.

    Raises:
        IdentificationError: neither records nor design describe it.
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
            "every storey in the building file would help"
        )
    design = _shear(description, description.storey_stiffness, USUAL_DAMPING)
    return KnownSuperstructure(design, "the superstructure is the design's; no record determines it")


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
    """Modes of a shear building with damping proportional to stiffness and this ratio in its first mode."""
    undamped = fixed_base_modes(ShearBuilding(description.base_mass, description.floor_mass, storeys, 0.0))
    coefficient = 2 * damping / float(undamped.angular_frequency[0])
    return fixed_base_modes(ShearBuilding(description.base_mass, description.floor_mass, storeys, coefficient))
