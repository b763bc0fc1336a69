"""Hardening of rubber with age, by which the expected stiffness of the isolation layer grows.

The stiffness of new rubber grows in proportion to its age. Accelerated tests gave natural rubber 14.6 % in 30 years,
high-damping rubber 5 to 26 % in 60 years, and a maker of lead-rubber bearings 5 % in ten years. Where a source gives
one number, its standard deviation is taken as a quarter of it: a choice, as wide as the range of high-damping rubber.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, date, datetime
from types import MappingProxyType
from typing import Literal

import numpy as np

from core.arrays import Vector
from core.drift.series import YEAR

Rubber = Literal["natural", "high_damping", "lead"]
RATES: Mapping[Rubber, tuple[float, float]] = MappingProxyType(
    {"natural": (0.146 / 30, 0.146 / 120), "high_damping": (0.155 / 60, 0.105 / 120), "lead": (0.005, 0.00125)}
)
"""1/year, relative growth of the stiffness of new rubber, and its standard deviation."""


@dataclass(frozen=True, slots=True)
class Ageing:
    """Expected hardening of a building's rubber."""

    installed: float
    """s since 1970-01-01 UTC."""
    rate: float
    """1/year, of the stiffness of new rubber."""
    std: float
    """1/year, standard deviation of the rate."""

    def change(self, time: Vector, epoch: float) -> Vector:
        """(n,) natural logarithm of the stiffness over that at `epoch`, at times in s since 1970."""
        return np.asarray(np.log1p(self.rate * self._age(time)) - np.log1p(self.rate * self._age(np.array(epoch))))

    def change_std(self, time: Vector, epoch: float) -> Vector:
        """(n,) error of the same, with its sign, by one standard deviation of the rate."""
        ages = self._age(time), self._age(np.array(epoch))
        now, then = (age / (1 + self.rate * age) for age in ages)
        return np.asarray(self.std * (now - then))

    def _age(self, time: Vector) -> Vector:
        """Years; rubber is new until it is installed."""
        return np.maximum(0.0, (time - self.installed) / YEAR)


def ageing_of(rubber: Rubber | None, installed: date | None) -> Ageing | None:
    """Hardening of a compound since a day; None where either is not known."""
    if rubber is None or installed is None:
        return None
    rate, std = RATES[rubber]
    return Ageing(datetime(installed.year, installed.month, installed.day, tzinfo=UTC).timestamp(), rate, std)
