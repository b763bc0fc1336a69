"""Is a displacement channel a measurement, or the accelerations beside it, integrated twice?

Some acquisition systems write such an integral as a channel of its own. Nothing in it is independent of the
accelerations. It follows them far above where the noise of a transducer would hide the motion, and its filter has taken
away slow motion that the accelerations hold. A transducer does neither; an integral does both.
"""

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription
from core.record import Direction, Record
from core.signals.noise import noise_std

FOLLOWED = 12.0
"""Hz: no transducer in use has less noise than the accelerometers' integral up to there."""
SLOW = (0.05, 0.5)
"""Hz, in which an integral's filter begins to take motion away."""
STARTS = 9
"""Bands that begin between these, evenly spread."""
FEWEST = 4
"""Lines of the spectrum in a band; a quarter of an octave where that is more."""
TAKEN = 0.8
"""A channel that holds less than that of a slow motion has been filtered."""
TOGETHER = 0.9
"""Coherence from which on two records hold the same motion."""


def transducer_reading(record: Record, description: BuildingDescription, direction: Direction) -> Vector | None:
    """(n,) m, of the layer's displacement as a transducer measured it; None where none did.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = (record.find(level, "acceleration", direction) for level in (base, ground))
    if displacement is None or above is None or below is None:
        return displacement
    return None if is_integral(displacement, above - below, record.rate) else displacement


def is_integral(displacement: Vector, relative_acceleration: Vector, rate: float) -> bool:
    """Whether a channel of displacement was made from the accelerations.

    Args:
        displacement: (n,) m, of the base slab relative to the ground.
        relative_acceleration: (n,) m/s², base slab minus ground.
        rate: Hz.

    Raises:
        RecordError: the record is shorter than 10 s.
    """
    own, other = noise_std(np.array([displacement, relative_acceleration]), rate)
    follows = other > own * (2 * np.pi * FOLLOWED) ** 2
    return bool(follows and _smallest_share(displacement, relative_acceleration, rate) < TAKEN)


def _smallest_share(displacement: Vector, relative: Vector, rate: float) -> float:
    """Of the slow motion that both records hold in common: the least share that the channel has; 1 if there is none.

    The accelerations' noise does not lower it: the regression is of the integral on the channel.
    """
    window = np.hanning(displacement.size)
    frequency = np.asarray(np.fft.rfftfreq(displacement.size, 1 / rate), dtype=float)[1:]
    moved, driven = (np.fft.rfft(window * (row - row.mean()))[1:] for row in (displacement, relative))
    integral, share = -driven / (2 * np.pi * frequency) ** 2, 1.0
    for start in np.searchsorted(frequency, np.geomspace(*SLOW, STARTS)):
        band = slice(start, max(start + FEWEST, int(np.searchsorted(frequency, 2**0.25 * frequency[start]))))
        common = float(np.abs(np.vdot(integral[band], moved[band])))
        own, other = (float(np.linalg.norm(row[band])) for row in (moved, integral))
        if common > TOGETHER * own * other > 0:
            share = min(share, own**2 / common)
    return share
