"""Floors above a layer whose motion is prescribed, with a share of the mass that the building file may have wrong."""

from dataclasses import replace

import numpy as np
from synthetic_observations import RATE, motion

from core.description import BuildingDescription
from core.estimators.result import RestoringForce
from core.fitting.observation import Observation

MODES = ((1.1, 0.02, 1.0), (3.0, 0.03, 0.2))
"""Frequency in Hz, damping ratio, and share in the motion of the floors' mean."""

CARRIES = 0.3
"""Motion, relative to the slab, of the floor that carries a damper, over that of the floors' mean."""
DAMPER = 3e5, 0.6, 0.1
"""Its mass in kg, frequency in Hz and damping ratio."""


def with_floors(one: Observation, change: float, described: BuildingDescription) -> Observation:
    """The observation of shaken ground, its force estimated with the described masses.

    Args:
        one: with the true force of the layer.
        change: relative change by which the described share of the floors in the mass becomes the true one.
        described: the building.
    """
    ground = RATE * np.gradient(motion(0.05, np.random.default_rng([1, int(one.start.timestamp())]))[1])
    slab = ground + RATE * np.gradient(one.layer.velocity)
    modal = -float(described.floor_mass.sum()) * sum(share * _relative(slab, f, z) for f, z, share in MODES)
    force = one.layer.force - change * modal
    return replace(
        one,
        layer=replace(one.layer, force=force),
        conditions=replace(one.conditions, ground=ground),
        estimate=RestoringForce("cms", force, force - modal, modal, one.layer.force_std, ()),
        building=described,
    )


def with_floor_damper(one: Observation) -> Observation:
    """The observation with a mass on a spring on a floor, which is not among the masses of the building file.

    Args:
        one: of a building with floors.
    """
    known, ground = one.estimate, one.conditions.ground
    assert known is not None
    mass, frequency, damping = DAMPER
    slab = ground + RATE * np.gradient(one.layer.velocity)
    floor = slab + CARRIES * sum(share * _relative(slab, f, z) for f, z, share in MODES)
    more = mass * (floor + _relative(floor, frequency, damping))
    return replace(
        one,
        layer=replace(one.layer, force=one.layer.force + more),
        estimate=replace(known, force=known.force + more, rigid=known.rigid + more),
    )


def _relative(slab: np.ndarray, frequency: float, damping: float) -> np.ndarray:
    """(n,) m/s², acceleration of an oscillator relative to the slab that drives it."""
    ω, own = 2 * np.pi * np.fft.rfftfreq(2 * slab.size, 1 / RATE), 2 * np.pi * frequency
    gain = ω**2 / (own**2 - ω**2 + 2j * damping * own * ω)
    return np.fft.irfft(gain * np.fft.rfft(slab, 2 * slab.size))[: slab.size]
