"""Buildings at random: about the paper's, each with masses, storeys, damping and isolation layer of its own."""

from dataclasses import dataclass

import numpy as np

from hidden.law import Layer
from hidden.superstructure import Superstructure

TOTAL_MASS = 24.1e6
"""kg, the paper's; a third of it is the base slab's."""
FLOOR_SHARE = np.array([2.7, 2.6, 2.4, 2.0, 1.9, 2.2, 2.3]) / 24.1
STOREY_STIFFNESS = np.array([3.10e9, 2.93e9, 2.34e9, 1.97e9, 1.59e9, 1.46e9, 1.34e9])
"""N/m."""
GRAVITY = 9.80665
"""m/s²."""


@dataclass(frozen=True, slots=True, eq=False)
class Building:
    """The true building."""

    superstructure: Superstructure
    layer: Layer


def building(rng: np.random.Generator, peak: float) -> Building:
    """A building at random; `peak` in m is about how far its layer will go."""
    floor_mass = TOTAL_MASS * FLOOR_SHARE * (1 + 0.05 * rng.standard_normal(7))
    superstructure = Superstructure(
        base_mass=TOTAL_MASS - float(floor_mass.sum()),
        floor_mass=floor_mass,
        storey_stiffness=STOREY_STIFFNESS * rng.uniform(0.8, 1.25) * (1 + 0.05 * rng.standard_normal(7)),
        damping_ratio=rng.uniform(0.01, 0.04, 7),
    )
    small = rng.random() < 0.5
    k = 475e6 * rng.uniform(0.85, 1.15)
    layer = Layer(
        k=k,
        c=6e6 * rng.uniform(0.7, 1.3),
        F_y=655e3 if small else rng.uniform(2e6, 7e6),
        D_y=1.5e-3 if small else rng.uniform(2e-3, 8e-3),
        beta=rng.uniform(0.4, 0.65),
        peak=peak,
        speed=peak * float(np.sqrt(k / TOTAL_MASS)),
    )
    return Building(superstructure, layer)
