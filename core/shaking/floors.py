"""Accelerations of the floors and drift of the storeys, by the superstructure that the base slab drives.

The modes of the best-known superstructure respond to the base slab's recorded acceleration. The floors that are
measured show the error of it; those that are not, and the storeys' drift, have the same relative error.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.building import FixedBaseModes
from core.description import BuildingDescription
from core.errors import IdentificationError
from core.estimators.result import RestoringForce
from core.estimators.superstructure import known_superstructure
from core.record import Direction, Record
from core.shaking.oscillators import oscillator_motion

STIFFNESS_ERROR = 0.2
"""Relative standard deviation of a storey's stiffness that no record determines. A choice."""


@dataclass(frozen=True, slots=True)
class FloorAcceleration:
    """Largest acceleration of one floor or of the base slab in one direction."""

    level: str
    direction: Direction
    peak: float
    """m/s², absolute."""
    std: float | None
    """m/s²; None where it is not known."""
    is_measured: bool
    """False if it is estimated from the levels that are measured."""


@dataclass(frozen=True, slots=True)
class StoreyDisplacement:
    """Largest displacement of one floor relative to the level below it, in one direction."""

    level: str
    """The floor above the storey."""
    direction: Direction
    peak: float
    """m."""
    std: float
    """m."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorMotion:
    """Motion of the base slab and of the floors in one direction."""

    accelerations: tuple[FloorAcceleration, ...]
    """Levels above the isolators, measured or estimated, from the base slab up."""
    storeys: tuple[StoreyDisplacement, ...]
    """From the lowest storey up; empty where nothing describes the superstructure."""


def floor_motion(
    record: Record,
    description: BuildingDescription,
    direction: Direction,
    force: RestoringForce,
    noise: dict[str, float | None],
) -> FloorMotion:
    """Peaks of all floors and storeys in one direction.

    Args:
        record: complete channels about their position at rest, one per level, quantity and direction.
        description: of the building.
        direction: horizontal; the base slab's acceleration in it is in the record.
        force: the restoring force in that direction, with the superstructure behind it.
        noise: m/s² by level, standard deviation of its accelerometer; None where it is not known.
    """
    measured = {
        level.name: samples
        for level in description.levels[1:]
        if (samples := record.find(level.name, "acceleration", direction)) is not None
    }
    peaks = {
        name: FloorAcceleration(name, direction, float(np.abs(samples).max()), noise.get(name), True)
        for name, samples in measured.items()
    }
    try:
        modes = known_superstructure([force], description).modes
    except IdentificationError:
        return FloorMotion(tuple(peaks.values()), ())
    base = measured[description.base.name]
    displacement, acceleration = driven(modes, description.floor_mass, base, record.rate)
    floors = [level.name for level in description.floors]
    error = _relative_error(
        [(measured[name], acceleration[row]) for row, name in enumerate(floors) if name in measured]
    )
    for name, samples in zip(floors, acceleration, strict=True):
        peak = float(np.abs(samples).max())
        peaks.setdefault(name, FloorAcceleration(name, direction, peak, error * peak, False))
    ordered = tuple(peaks[level.name] for level in description.levels[1:] if level.name in peaks)
    return FloorMotion(ordered, _storeys(displacement, floors, direction, error, force))


def driven(modes: FixedBaseModes, floor_mass: Vector, base: Vector, rate: float) -> tuple[Matrix, Matrix]:
    """Displacement of the floors relative to the base slab, and their absolute acceleration.

    Args:
        modes: all modes of the superstructure, normalised to the masses.
        floor_mass: (floors,) kg.
        base: (n,) m/s², acceleration of the base slab.
        rate: Hz.

    Returns:
        (floors, n) m and (floors, n) m/s².
    """
    displacement = np.zeros((floor_mass.size, base.size))
    acceleration = np.zeros_like(displacement)
    every = zip(modes.angular_frequency, modes.damping_ratio, modes.shape.T, strict=True)
    for angular, damping, shape in every:
        u, v = oscillator_motion(base, rate, float(angular), float(damping))
        share = shape * (shape @ floor_mass)
        displacement += np.outer(share, u)
        acceleration -= np.outer(share, angular**2 * u + 2 * damping * angular * v)
    return displacement, acceleration


def _relative_error(pairs: Sequence[tuple[Vector, Vector]]) -> float:
    """Root mean square of the floors' estimate less their records, over that of the records."""
    error = sum(float(np.sum((one - other) ** 2)) for one, other in pairs)
    size = sum(float(np.sum(one**2)) for one, _ in pairs)
    return float(np.sqrt(error / size)) if size > 0 else 1.0


def _storeys(
    displacement: Matrix, floors: Sequence[str], direction: Direction, error: float, force: RestoringForce
) -> tuple[StoreyDisplacement, ...]:
    drift = np.abs(np.diff(displacement, axis=0, prepend=0.0)).max(axis=1)
    stiffness = np.full(drift.size, STIFFNESS_ERROR)
    if force.superstructure is not None and force.storeys is not None:
        stiffness = np.sqrt(np.diag(force.storeys.covariance))
    return tuple(
        StoreyDisplacement(name, direction, float(peak), float(peak * np.hypot(error, relative)))
        for name, peak, relative in zip(floors, drift, stiffness, strict=True)
    )
