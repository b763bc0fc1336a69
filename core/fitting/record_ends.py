"""How far is a force to be relied on near the ends of a record that begins or ends in motion?

What the layer did before the record is not known: what it left in filters and modes is missing from the force, and a
hysteretic law does not know the state that it begins with. Both are forgotten within some seconds.
"""

import numpy as np

from core.arrays import Vector

EDGE = 0.5
"""s, of the record at either end."""
AT_REST = 0.01
"""Of the strongest EDGE: an end that is weaker is taken to be at rest."""
IGNORED, FADED = 5.0, 15.0
"""s from an end in motion: up to the one nothing is relied on, from the other on everything; in simulated records the
force there errs by up to 13 %, 2 % and 0.5 % of its root mean square in the first, second and third five seconds."""
LONGEST = 0.25
"""Of the record, that is lost so at either end."""


def relied_on(force: Vector, rate: float) -> Vector:
    """(n,) from 0 to 1; 1 everywhere for a record that begins and ends at rest.

    Args:
        force: (n,) N.
        rate: Hz.
    """
    window, count = np.ones(force.size), max(1, round(EDGE * rate))
    power = np.convolve(force**2, np.full(count, 1 / count), mode="valid")
    ignored, faded = (min(1.0, LONGEST * force.size / rate / FADED) * one for one in (IGNORED, FADED))
    along = np.clip((np.arange(force.size) / rate - ignored) / (faded - ignored), 0, 1)
    rising = np.sin(np.pi / 2 * along) ** 2
    for end, shape in ((power[0], rising), (power[-1], rising[::-1])):
        if end > AT_REST**2 * power.max():
            window *= shape
    return window
