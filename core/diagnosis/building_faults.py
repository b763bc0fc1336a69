"""Faults of sensors, superstructure and masses, which are judged before the isolation layer.

A force is mass times acceleration: if the building file states masses that are too large, all forces are too large by
one factor, and so are the stiffness, the damping and the yield force of a fitted model. Its yield displacement is not.
The hypothesis of a wrong total mass competes with values as designed and with values that differ each by itself.
How the total is divided between floors and slab shows in the form of the force (core.diagnosis.floor_share).
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from core.analysis import EventAnalysis
from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.diagnosis.floor_share import FloorShare
from core.diagnosis.sensor_faults import IN_USE, BuildingFault, Cause, sensor_faults
from core.diagnosis.softened_storey import softened_storey
from core.effects import EFFECTS
from core.fitting.fit import Fit
from core.model.first_model import first_model
from core.model.isolator import Isolator, Key
from core.record import Direction
from core.rounding import plain, with_std
from core.units import percent

TOTAL_MASS, FLOOR_SHARE = "mass", "floor_share"
"""Kinds of faults of the masses."""
CHECK_MASSES = "Check the masses in the building file, correct them if they are wrong, and run the analysis again"
"""Remedy for both."""
MORE, LESS = ("above", "large"), ("below", "small")
"""Side of the design on which forces lie, and the size of the given mass that has this effect."""
LENGTHS = ("D_y",)
"""Design values that do not scale with the mass."""
DESIGN = 0.04
"""Standard deviation of the logarithm of a value as built about its design value. A choice."""
COMMON = 0.15
"""Standard deviation of the logarithm of the factor that a wrong mass makes. A choice."""
OFF = 0.2
"""Standard deviation of the logarithm of a design value that is wrong by itself. A choice."""
DECISIVE = 2.5
"""Smallest log evidence of a wrong mass over the design's usual scatter. A choice."""
FEWEST = 2
"""Smallest number of values that a mass scales: fewer cannot distinguish it from one wrong value."""


def building_faults(
    analyses: Sequence[EventAnalysis], description: BuildingDescription, fit: Fit | None = None
) -> tuple[BuildingFault, ...]:
    """Faults of sensors, superstructure and mass, the cause first; empty if there are none.

    Sensors come first, judged by kinematics alone: an erring one, still in use, makes a storey look soft, a layer look
    damped and a mass look wrong, so it must be corrected first. The superstructure comes next: its stiffness is
    estimated with no model of the layer, and the force allows for the estimate. The mass comes last: it shows in
    nothing but a model of the layer, and only if that model leaves nothing to explain.

    Args:
        analyses: of several earthquakes, also of those that were refused.
        description: of the building.
        fit: of the design's model (`core.model.first_model`) to the same earthquakes, if it leaves nothing
            unexplained; None where there is none, and the mass is not judged.
    """
    sensors = sensor_faults(analyses, description)
    if any(fault.kind in IN_USE for fault in sensors):
        return sensors
    mass = None if fit is None else _mass(fit, description)
    return (*sensors, *_storeys(analyses, description), *([] if mass is None else [mass]))


def _storeys(analyses: Sequence[EventAnalysis], description: BuildingDescription) -> tuple[BuildingFault, ...]:
    """Softened storeys, each in the direction with the most certain result."""
    faults: dict[str | None, BuildingFault] = {}
    for direction in description.horizontal_directions:
        fault = _storey(analyses, description, direction)
        if fault is not None and _certainty(fault) > _certainty(faults.get(fault.channel)):
            faults[fault.channel] = fault
    return tuple(faults.values())


def _certainty(fault: BuildingFault | None) -> float:
    return 0.0 if fault is None or fault.std is None else abs(fault.value) / fault.std


def _storey(
    analyses: Sequence[EventAnalysis], description: BuildingDescription, direction: Direction
) -> BuildingFault | None:
    known = [analysis.directions[direction] for analysis in analyses if direction in analysis.directions]
    storeys = [one.restoring_force.storeys for one in known if one.restoring_force.storeys is not None]
    softened = softened_storey(storeys) if storeys else None
    if softened is None:
        return None
    names = [floor.name for floor in description.floors]
    instead = " or ".join(f"that below {names[storey]!r}" for storey in softened.others)
    less = with_std(-100 * softened.change, 100 * softened.std)
    name = names[softened.storey]
    fault = (
        f"direction {direction}: the storey below {name!r} has {less} % less stiffness than designed, against the "
        "other storeys"
    )
    if instead:
        fault = (
            f"direction {direction}: the storey below {name!r} has {less} % less stiffness than designed, against the "
            f"other storeys (or {instead}: a sensor between would show it)"
        )
    remedy = (
        "Look for damage there, or correct its stiffness in the building file; the estimated force already allows for "
        "it"
    )
    masses = (
        "Floor masses that differ from the building file would explain some of the records about as well; all together "
        "speak for the storey"
    )
    message = f"{fault}. {masses}. {remedy}" if softened.or_masses else f"{fault}. {remedy}"
    return BuildingFault(Cause.SUPERSTRUCTURE, "storey", names[softened.storey], softened.change, softened.std, message)


def _mass(fit: Fit, description: BuildingDescription) -> BuildingFault | None:
    wrong = wrong_mass(fit, first_model(description).isolator, asdict(description.isolation.design))
    if wrong is None:
        return None
    off, std = 100 * abs(wrong.change), 100 * wrong.std
    side, size = MORE if wrong.change > 0 else LESS
    fault = (
        f"stiffness, damping and yield force all are {with_std(off, std)} % {side} the design, the yield displacement "
        f"is not, as if all masses were that much too {size}"
    )
    instead = (
        "Records cannot distinguish this from isolators that all differ from their design by this factor: the weight "
        "on the isolators, or a test of one, would"
    )
    message = f"{fault}. {instead}. {CHECK_MASSES}"
    return BuildingFault(Cause.MASS, TOTAL_MASS, None, wrong.change, wrong.std, message)


def floor_share_fault(found: FloorShare) -> BuildingFault:
    """A wrong share of the floors in the mass; the forces were corrected for it.

    Its value is the relative error of the floors' masses in the building file if the slab's is right.
    """
    ratio, std = found.ratio
    floors = with_std(100 * abs(ratio - 1), 100 * std)
    slab = with_std(100 * abs(1 - 1 / ratio), 100 * std / ratio**2)
    share, stated = with_std(100 * found.share, 100 * found.stated * found.std), percent(found.stated)
    (_, floors_are), (_, slab_is) = (MORE, LESS) if ratio > 1 else (LESS, MORE)
    fault = (
        f"the floors have {share} % of the mass above the isolators by the records, and {stated} in the building file, "
        f"as if the floors' masses were {floors} % too {floors_are}, or the base slab's {slab} % too {slab_is}"
    )
    message = f"{fault}. {_taken(found)}. {CHECK_MASSES}"
    return BuildingFault(Cause.MASS, FLOOR_SHARE, None, ratio - 1, std, message, is_corrected=True)


def _taken(found: FloorShare) -> str:
    fitted, before, after = percent(found.worth.fitted), plain(found.before.fitted, 3), plain(found.after.fitted, 3)
    if found.worth.held_out is None:
        return (
            f"This explains {fitted} of the excess error where the model was fitted: the noise ratio falls from "
            f"{before} to {after}"
        )
    return (
        f"This explains {fitted} of the excess error where the model was fitted and {percent(found.worth.held_out)} on "
        f"held-out earthquakes: the noise ratio falls from {before} to {after}"
    )


@dataclass(frozen=True, slots=True)
class WrongMass:
    """Common factor of all forces."""

    change: float
    """Relative difference of the stated mass from the one that agrees with the layer's design."""
    std: float


def wrong_mass(fit: Fit, design: Isolator, given: Mapping[str, float | None]) -> WrongMass | None:
    """Error of the stated mass; None unless it explains the fitted values best.

    A model that lacks an effect differs from the design for that reason: the residual of the fit should be noise.

    Args:
        fit: of a model whose effects have design values; see core.effect.Effect.design.
        design: the same model at the building's design values.
        given: the design values by name, None for those that the building file does not give.
    """
    names = [name for name, value in given.items() if value is not None]
    here, change = _logarithms(fit.model, fit.free)
    there, _ = _logarithms(design, fit.free)
    kept = [name for name in names if name in here and name in there]
    forces = np.array([name not in LENGTHS for name in kept])
    if forces.sum() < FEWEST:
        return None
    deviation = np.array([here[name] - there[name] for name in kept])
    rows = np.array([change[name] for name in kept])
    noise = rows @ fit.covariance @ rows.T
    designed = noise + DESIGN**2 * np.eye(len(kept))
    common = designed + COMMON**2 * np.outer(forces, forces)
    mass = _evidence(deviation, common)
    apart = _evidence(deviation, noise + OFF**2 * np.eye(len(kept)))
    if mass < max(apart, DECISIVE + _evidence(deviation, designed)):
        return None
    factor, std = _common(deviation, designed, forces)
    return WrongMass(float(np.expm1(factor)), float(np.exp(factor)) * std)


def _logarithms(model: Isolator, free: tuple[Key, ...]) -> tuple[dict[str, float], dict[str, Vector]]:
    """Logarithms of the model's positive design values, and their (free,) derivatives by fitted parameters."""
    values, slopes = dict[str, float](), dict[str, Vector]()
    for effect, parameters in model.effects.items():
        for name, value_of in EFFECTS[effect].design.items():
            own = {key: parameters[key] for key in inspect.signature(value_of).parameters}
            if (value := value_of(**own)) > 0:
                by = {(effect, key): _derivative(value_of, own, key) / value for key in own}
                values[name], slopes[name] = float(np.log(value)), np.array([by.get(key, 0.0) for key in free])
    return values, slopes


def _derivative(value_of: Callable[..., Any], parameters: Mapping[str, float], key: str) -> float:
    """Exact to rounding, by a step into the complex plane (Squire and Trapp 1998)."""
    step = 1e-20 * parameters[key]
    return float(value_of(**{**parameters, key: parameters[key] + 1j * step}).imag / step) if step else 0.0


def _evidence(deviation: Vector, covariance: Matrix) -> float:
    """Log probability density of the deviation."""
    return -0.5 * float(deviation @ np.linalg.solve(covariance, deviation)) - 0.5 * float(
        np.linalg.slogdet(covariance)[1]
    )


def _common(deviation: Vector, covariance: Matrix, forces: Vector) -> tuple[float, float]:
    """Logarithm of the factor by least squares, and its standard deviation."""
    weighted = np.linalg.solve(covariance, forces.astype(float))
    variance = 1 / float(weighted @ forces)
    return variance * float(weighted @ deviation), float(np.sqrt(variance))
