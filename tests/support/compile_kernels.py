"""Compile the kernels of `core` and of the hidden laws, which later processes get from Numba's cache.

.ci/run does so once. Otherwise processes that start together compile the same kernels at the same time.
"""

import numpy as np
from hidden.trial import trial

from core.building import fixed_base_modes
from core.model.force_response import force_response
from core.model.isolator import Conditions
from core.model.simulation import Axis, respond
from core.paper import BUILDING, ISOLATOR

RATE = 100.0
"""Hz."""


def main() -> None:
    """Drive each kernel once."""
    motion = 0.1 * np.sin(np.arange(100) / 20)
    axis = Axis(fixed_base_modes(BUILDING), motion, Conditions.usual(motion.size, RATE))
    for axes in ([axis], [axis, axis]):
        respond(axes, BUILDING.base_mass, ISOLATOR, RATE)
    every = [(effect, parameter) for effect, values in ISOLATOR.effects.items() for parameter in values]
    for wanted in ([], every):
        force_response(ISOLATOR, motion, np.gradient(motion) * RATE, RATE, wanted=wanted)
    trial("hardening", 1)


if __name__ == "__main__":
    main()
