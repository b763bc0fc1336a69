"""The paper's building as sensors sample it: computed five times finer, so that nothing lies beyond half their rate."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from ground_motions import RATE
from scipy import signal

from core.arrays import Vector
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR

FINER = 5


@dataclass(frozen=True, slots=True, eq=False)
class SampledResponse:
    """At RATE, without noise."""

    ground_acceleration: Vector
    base_acceleration: Vector
    displacement: Vector
    velocity: Vector


@cache
def sampled_response(motion: Callable[[], Vector], scale: float = 1.0, rest: float = 0.0) -> SampledResponse:
    """The response to a scaled motion, and for so many seconds after it."""
    fine = signal.resample(scale * motion(), FINER * motion().size)
    ground = np.append(fine, np.zeros(round(rest * FINER * RATE)))
    moved = simulate(BUILDING, ISOLATOR, ground, FINER * RATE)
    each = slice(None, None, FINER)
    return SampledResponse(
        ground[each], moved.base_acceleration[each], moved.isolator_displacement[each], moved.isolator_velocity[each]
    )
