"""Explanations of a change by a wrong mass or a wrong gain, tested against all series of a building.

The change since one time is estimated in every series. A wrong mass scales the force, and with it stiffness and damping
of every direction alike, and moves the frequencies by half as much; a wrong gain scales stiffness and damping of one
direction and nothing else; a change of the isolation layer is free. Each explanation is a pattern with one size, tested
by chi-square.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import scipy

from core.arrays import Vector
from core.drift.change_statistics import change_size
from core.drift.monitor import Monitoring
from core.drift.quantities import LAYER_QUANTITIES

SIGNIFICANCE = 0.05
"""Probability of a chi-square as large as this or larger below which an explanation is ruled out. The
usual level; no benchmark tests it."""
MASS = "a mass"
GAIN = "a gain of the sensors of direction {direction}"
AGREES = "{what} that is {size} % off agrees with all series"
IS_RULED_OUT = "{what} that is {size} % off is ruled out by all series"


@dataclass(frozen=True, slots=True)
class Shift:
    """Change of one series since a time."""

    quantity: str
    subject: str
    size: float
    """Natural logarithm."""
    std: float
    """Standard deviation of the size."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """An error that could explain the shifts, and whether it agrees with every series."""

    cause: str
    """`mass`, or `gain/x` for the sensors of a direction."""
    size: float
    """Relative error of mass or gain that fits best."""
    probability: float
    """Probability of disagreeing this much or more if it is the cause."""
    message: str
    """One clause for an engineer."""

    @property
    def is_possible(self) -> bool:
        """True if it is not ruled out."""
        return self.probability >= SIGNIFICANCE


def shifts(monitorings: Sequence[Monitoring], since: datetime) -> tuple[Shift, ...]:
    """Shifts of stiffness, damping and frequencies.

    Args:
        monitorings: all series of a building; those without a tested event on or after the time are left out.
        since: time from which on the change applies, aware.
    """
    shifted = []
    for one in monitorings:
        if one.tested is None or one.series.quantity not in (*LAYER_QUANTITIES, "frequency"):
            continue
        pattern = np.array([float(event.time >= since) for event in one.tested.events])
        if not pattern.any():
            continue
        size = change_size(one.tested.innovations(), pattern)
        shifted.append(Shift(one.series.quantity, one.series.subject, size.size, size.std))
    return tuple(shifted)


def explanations(observed: Sequence[Shift]) -> tuple[Explanation, ...]:
    """A wrong mass and a wrong gain of each direction as explanations, the likeliest first.

    Empty for fewer than two shifts: a single one agrees with every explanation.
    """
    if len(observed) < 2:
        return ()
    size, std = (np.array([getattr(one, name) for one in observed]) for name in ("size", "std"))
    directions = sorted({one.subject for one in observed if one.quantity in LAYER_QUANTITIES})
    every = [_explanation("mass", np.array([_mass_effect(one) for one in observed]), size, std)]
    for direction in directions:
        pattern = np.array([float(one.quantity in LAYER_QUANTITIES and one.subject == direction) for one in observed])
        every.append(_explanation(f"gain/{direction}", pattern, size, std))
    return tuple(sorted(every, key=lambda one: -one.probability))


def _mass_effect(one: Shift) -> float:
    """Shift of a logarithm per shift of the logarithm of the mass; the force is computed with the old mass."""
    return -1.0 if one.quantity in LAYER_QUANTITIES else -0.5


def _explanation(cause: str, pattern: Vector, size: Vector, std: Vector) -> Explanation:
    weight = 1 / std**2
    fitted = float((weight * pattern) @ size / ((weight * pattern) @ pattern))
    chi_square = float(weight @ (size - fitted * pattern) ** 2)
    probability = float(scipy.stats.chi2.sf(chi_square, size.size - 1))
    what = MASS if cause == "mass" else GAIN.format(direction=cause.removeprefix("gain/"))
    template = AGREES if probability >= SIGNIFICANCE else IS_RULED_OUT
    message = template.format(what=what, size=f"{100 * np.expm1(fitted):+.1f}".replace("-", "−"))
    return Explanation(cause, float(np.expm1(fitted)), probability, message)
