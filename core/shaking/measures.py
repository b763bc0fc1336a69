"""Measures of an earthquake's strength at the building, from the record of the lowest level that has one."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.record import Direction, Record
from core.shaking.intensity import instrumental_intensity, long_period_velocity, without_slow_motion
from core.shaking.oscillators import response_spectrum

GRAVITY = 9.80665
"""m/s², standard."""
SPECTRUM_PERIODS = np.round(np.geomspace(0.05, 10.0, 47), 4)
"""s, twenty a decade."""
SIGNIFICANT = (0.05, 0.95)
"""Shares of the Arias intensity between which the shaking is significant (Trifunac and Brady, 1975)."""


@dataclass(frozen=True, slots=True, eq=False)
class Shaking:
    """Strength of the shaking at one level; intensity and class are unofficial."""

    level: str
    is_below_isolators: bool
    """False if only levels above the isolators are measured, which shake less."""
    components: tuple[Direction, ...]
    """Directions of the accelerations that were recorded; one horizontal at least."""
    pga: float
    """m/s², largest horizontal acceleration."""
    pgv: float
    """m/s, largest horizontal velocity, without what is slower than 20 s."""
    intensity: float
    """JMA instrumental intensity; a lower bound unless there are three components."""
    long_period_velocity: float
    """m/s, which gives the class of long-period motion; a lower bound unless both horizontal components are there."""
    arias: float
    """m/s, π / 2g ∫ a² dt (Arias, 1970), of the stronger horizontal component."""
    duration: float
    """s, in which the horizontal components' Arias intensity rises from 5 to 95 %."""
    spectrum: Mapping[Direction, Vector]
    """(47,) m/s² by horizontal direction: pseudo-acceleration at SPECTRUM_PERIODS, 5 % damping."""


def shaking(record: Record, description: BuildingDescription) -> Shaking | None:
    """Strength of the shaking at the ground or, without a record of it, at the lowest level above.

    Args:
        record: complete channels about their position at rest, one per level, quantity and direction.
        description: of the building.

    Returns:
        None where no level has a horizontal acceleration.
    """
    for level in description.levels:
        every: dict[Direction, Vector] = {
            direction: samples
            for direction in ("x", "y", "z")
            if (samples := record.find(level.name, "acceleration", direction)) is not None
        }
        if every.keys() & {"x", "y"}:
            return _measures(level.name, level is description.ground, every, record.rate)
    return None


def significant_duration(acceleration: Matrix, rate: float) -> float:
    """s, in which ∫ a² dt over all components rises from 5 to 95 %.

    Args:
        acceleration: (components, n) m/s².
        rate: Hz.
    """
    energy = scipy.integrate.cumulative_trapezoid(np.sum(acceleration**2, axis=0), dx=1 / rate, initial=0.0)
    first, last = np.searchsorted(energy, np.array(SIGNIFICANT) * energy[-1])
    return float(last - first) / rate


def arias_intensity(acceleration: Vector, rate: float) -> float:
    """m/s, π / 2g ∫ a² dt of (n,) m/s² at a rate in Hz."""
    return float(np.pi / (2 * GRAVITY) * np.trapezoid(acceleration**2, dx=1 / rate))


def _measures(level: str, is_ground: bool, every: Mapping[Direction, Vector], rate: float) -> Shaking:
    horizontal = np.array([samples for direction, samples in every.items() if direction != "z"])
    slow = without_slow_motion(horizontal, rate)
    return Shaking(
        level=level,
        is_below_isolators=is_ground,
        components=tuple(every),
        pga=float(np.abs(horizontal).max()),
        pgv=float(np.abs(scipy.integrate.cumulative_trapezoid(slow, dx=1 / rate, initial=0.0)).max()),
        intensity=instrumental_intensity(np.array(list(every.values())), rate),
        long_period_velocity=long_period_velocity(horizontal, rate),
        arias=max(arias_intensity(one, rate) for one in horizontal),
        duration=significant_duration(horizontal, rate),
        spectrum={name: response_spectrum(one, rate, SPECTRUM_PERIODS) for name, one in every.items() if name != "z"},
    )
