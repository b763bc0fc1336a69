"""Which sensors may the estimator see, and what did they measure?"""

from collections.abc import Collection

import numpy as np

from core.description import BuildingDescription
from core.errors import ModelError, RecordError
from core.estimators.estimator import InstrumentedSuperstructure
from core.record import Direction, Record
from core.signals.conditioning import band_passed


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
        raise RecordError("no floor above the base slab was recorded; one, best the roof, would do")
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
