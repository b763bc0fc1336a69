"""Which causes agree with what the series of one building show together?

A change is estimated in every series from the same time on. A wrong mass scales the force and with it stiffness and
damping of every direction alike, and moves the frequencies by half of it; a wrong gain scales stiffness and damping of
one direction and nothing else; a change of the layer is free. Each cause is a pattern with one size, judged by
chi-square.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from scipy.stats import chi2

from core.arrays import Vector
from core.drift.causes import LAYER
from core.drift.monitor import Monitoring
from core.drift.sequential import change

AGREES = 0.05
"""Probability of what is seen, or worse, from which on a cause is not ruled out."""


@dataclass(frozen=True, slots=True)
class Shift:
    """Change of one series since a time."""

    quantity: str
    subject: str
    size: float
    """Natural logarithm."""
    std: float


@dataclass(frozen=True, slots=True)
class Explanation:
    """A cause, and whether it agrees with every series."""

    cause: str
    """`mass`, or `gain/x` for the sensors of a direction."""
    size: float
    """Relative change of mass or gain that fits best."""
    probability: float
    """Of disagreeing as much as this or more if it is the cause."""
    message: str

    @property
    def is_possible(self) -> bool:
        """Whether it is not ruled out."""
        return self.probability >= AGREES


def shifts(monitorings: Sequence[Monitoring], since: datetime) -> tuple[Shift, ...]:
    """Of stiffness, damping and frequencies, of each series with events on and after a time."""
    found = []
    for one in monitorings:
        if one.judged is None or one.series.quantity not in (*LAYER, "frequency"):
            continue
        pattern = np.array([float(dated.time >= since) for dated in one.judged.dated])
        if not pattern.any():
            continue
        size = change(one.judged.innovations(), pattern)
        found.append(Shift(one.series.quantity, one.series.subject, size.size, size.std))
    return tuple(found)


def explanations(found: Sequence[Shift]) -> tuple[Explanation, ...]:
    """The causes that there could be beside a change of the layer or the building, the likeliest first.

    Only where two series and more tell them apart: one alone agrees with everything.
    """
    if len(found) < 2:
        return ()
    size, std = (np.array([getattr(one, name) for one in found]) for name in ("size", "std"))
    directions = sorted({one.subject for one in found if one.quantity in LAYER})
    every = [_explanation("mass", np.array([_of_mass(one) for one in found]), size, std)]
    for direction in directions:
        pattern = np.array([float(one.quantity in LAYER and one.subject == direction) for one in found])
        every.append(_explanation(f"gain/{direction}", pattern, size, std))
    return tuple(sorted(every, key=lambda one: -one.probability))


def _of_mass(one: Shift) -> float:
    """Change of a logarithm by that of the mass: the force is made with the mass as it was."""
    return -1.0 if one.quantity in LAYER else -0.5


def _explanation(cause: str, pattern: Vector, size: Vector, std: Vector) -> Explanation:
    weight = 1 / std**2
    fitted = float((weight * pattern) @ size / ((weight * pattern) @ pattern))
    chi_square = float(weight @ (size - fitted * pattern) ** 2)
    probability = float(chi2.sf(chi_square, size.size - 1))
    verdict = "agrees with" if probability >= AGREES else "is ruled out by"
    what = "a mass" if cause == "mass" else f"a gain of the sensors of direction {cause.removeprefix('gain/')}"
    message = f"{what} that is {100 * np.expm1(fitted):+.1f} % off {verdict} all series".replace("-", "−")
    return Explanation(cause, float(np.expm1(fitted)), probability, message)
