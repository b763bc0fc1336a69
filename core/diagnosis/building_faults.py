"""Faults of sensors, superstructure and masses, which are judged before the isolation layer."""

from collections.abc import Sequence
from dataclasses import asdict

from core.analysis import EventAnalysis
from core.description import BuildingDescription
from core.diagnosis.sensor_faults import BuildingFault, Cause, sensor_faults
from core.diagnosis.softened_storey import softened_storey
from core.diagnosis.wrong_mass import wrong_mass
from core.fitting.fit import Fit
from core.model.first_model import first_model
from core.record import Direction
from core.rounding import with_std

UNMENDED = frozenset({"gain", "delay", "clock", "clock_jump", "drift"})
"""Faults with which a channel stays in use; channels with other faults are corrected or excluded."""


def building_faults(
    analyses: Sequence[EventAnalysis], description: BuildingDescription, fit: Fit | None = None
) -> tuple[BuildingFault, ...]:
    """Faults of sensors, superstructure and mass, the cause first; empty if there are none.

    Sensors come first, judged by kinematics alone: an erring one, still in use, makes a storey look soft, a layer look
    damped and a mass look wrong, so it must be corrected first. The superstructure comes next: its
    stiffness is found with no model of the layer, and the force allows for what was found. The mass comes last: it
    shows in nothing but a model of the layer, and only if that model leaves nothing to explain.

    Args:
        analyses: of several earthquakes, also of those that were refused.
        description: of the building.
        fit: of the design's model (`core.model.first_model`) to the same earthquakes, if it leaves nothing
            unexplained; None where there is none, and the mass is not judged.
    """
    sensors = sensor_faults(analyses, description)
    if any(suspect.kind in UNMENDED for suspect in sensors):
        return sensors
    mass = None if fit is None else _mass(fit, description)
    return (*sensors, *_storeys(analyses, description), *([] if mass is None else [mass]))


def _storeys(analyses: Sequence[EventAnalysis], description: BuildingDescription) -> tuple[BuildingFault, ...]:
    """Softened storeys, each in the direction with the most certain result."""
    found: dict[str | None, BuildingFault] = {}
    for direction in description.horizontal_directions:
        suspect = _storey(analyses, description, direction)
        if suspect is not None and _certainty(suspect) > _certainty(found.get(suspect.channel)):
            found[suspect.channel] = suspect
    return tuple(found.values())


def _certainty(suspect: BuildingFault | None) -> float:
    return 0.0 if suspect is None or suspect.std is None else abs(suspect.value) / suspect.std


def _storey(
    analyses: Sequence[EventAnalysis], description: BuildingDescription, direction: Direction
) -> BuildingFault | None:
    known = [analysis.directions[direction] for analysis in analyses if direction in analysis.directions]
    storeys = [one.restoring_force.storeys for one in known if one.restoring_force.storeys is not None]
    found = softened_storey(storeys) if storeys else None
    if found is None:
        return None
    names = [floor.name for floor in description.floors]
    instead = " or ".join(f"that below {names[storey]!r}" for storey in found.others)
    less = with_std(-100 * found.change, 100 * found.std)
    message = (
        f"direction {direction}: the storey below {names[found.storey]!r} has {less} % less stiffness than designed, "
        f"against the other storeys"
        f"{f' (or {instead}: a sensor between would show it)' if instead else ''}. Look for damage there, or correct "
        "its stiffness in the building file; the estimated force already allows for it"
    )
    return BuildingFault(Cause.SUPERSTRUCTURE, "storey", names[found.storey], found.change, found.std, message)


def _mass(fit: Fit, description: BuildingDescription) -> BuildingFault | None:
    found = wrong_mass(fit, first_model(description).isolator, asdict(description.isolation.design))
    if found is None:
        return None
    percent, std = 100 * abs(found.change), 100 * found.std
    message = (
        f"stiffness, damping and yield force all are {with_std(percent, std)} % "
        f"{'above' if found.change > 0 else 'below'} the design, the yield displacement is not: as if the given mass "
        f"were that much too {'large' if found.change > 0 else 'small'}. Records cannot distinguish this from "
        "isolators that all differ from their design by this factor: the weight on "
        "the isolators, or a test of one, would"
    )
    return BuildingFault(Cause.MASS, "mass", None, found.change, found.std, message)
