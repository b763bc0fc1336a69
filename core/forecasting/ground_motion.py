"""Ground motions that a forecast is driven by, and their scaling."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from core.arrays import Vector
from core.errors import RecordError
from core.frozen import FrozenDict
from core.record import Direction
from core.rounding import plain
from core.shaking.oscillators import response_spectrum

STRONGEST = 100.0
"""m/s², about ten times gravity: an acceleration beyond it is in another unit, or scaled without sense."""
FEWEST = 10
"""Samples of the shortest ground motion. A choice."""
SPECTRAL_POINTS = 30
"""Periods at which a motion is compared with a design spectrum, at equal ratios. A choice."""
PERIODS = (0.5, 1.5)
"""Range of periods, over the period of the building on its isolators, in which a motion is scaled to a design spectrum;
about that of ASCE 7-16, section 17.3.3 (0.75 and 1.25 of the periods with extreme properties). A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundMotion:
    """Acceleration of the ground below the isolators, in the building's directions."""

    name: str
    rate: float
    """Hz."""
    accelerations: Mapping[Direction, Vector]
    """(n,) m/s² by direction, one horizontal at least; z upwards."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise RecordError(f"{self.name}: the sampling rate must be positive, got {self.rate} Hz")
        if not {"x", "y"} & {*self.accelerations}:
            raise RecordError(f"{self.name}: it has no horizontal acceleration; give one in direction x or y")
        sizes = {direction: samples.shape for direction, samples in self.accelerations.items()}
        if len(set(sizes.values())) > 1 or any(len(size) != 1 for size in sizes.values()):
            raise RecordError(f"{self.name}: its components must be series of one length, got {sizes}")
        for direction, samples in self.accelerations.items():
            _check(f"{self.name}, direction {direction}", samples)
        if not self.pga > 0:
            raise RecordError(f"{self.name}: the ground does not move")
        object.__setattr__(self, "accelerations", FrozenDict(self.accelerations))

    @classmethod
    def of(
        cls,
        name: str,
        rate: float,
        *,
        x: ArrayLike | None = None,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
    ) -> "GroundMotion":
        """A motion from arrays.

        Args:
            name: of the earthquake or the wave.
            rate: Hz.
            x: (n,) m/s²; None where there is none.
            y: the same.
            z: the same, upwards.

        Raises:
            RecordError: no horizontal component, components of other lengths, gaps, or another unit.
        """
        given: dict[Direction, ArrayLike | None] = {"x": x, "y": y, "z": z}
        return cls(name, rate, {key: np.asarray(one, dtype=float) for key, one in given.items() if one is not None})

    @property
    def horizontal(self) -> dict[Direction, Vector]:
        """(n,) m/s² by horizontal direction."""
        return {direction: samples for direction, samples in self.accelerations.items() if direction != "z"}

    @property
    def pga(self) -> float:
        """m/s², largest acceleration of a horizontal component."""
        return max(float(np.abs(samples).max()) for samples in self.horizontal.values())

    def times(self, factor: float) -> "GroundMotion":
        """The motion with all components multiplied by a factor.

        Raises:
            RecordError: the factor is not a positive number, or the motion becomes stronger than any earthquake.
        """
        if not (np.isfinite(factor) and factor > 0):
            raise RecordError(f"{self.name}: a ground motion cannot be scaled by {factor}; give a positive number")
        if factor * self.pga > STRONGEST:
            raise RecordError(
                f"{self.name}: scaled by {plain(factor, 3)}, the ground would reach {plain(factor * self.pga, 3)} "
                f"m/s², beyond {STRONGEST:g} m/s²; scale it to less"
            )
        return replace(self, accelerations={key: factor * samples for key, samples in self.accelerations.items()})

    def only(self, direction: Direction) -> "GroundMotion":
        """The motion with this horizontal component alone, and the vertical one."""
        return replace(
            self, accelerations={key: one for key, one in self.accelerations.items() if key in (direction, "z")}
        )


def _check(name: str, samples: Vector) -> None:
    if samples.size < FEWEST:
        raise RecordError(f"{name}: {samples.size} samples are too few; give {FEWEST} or more")
    if not np.isfinite(samples).all():
        raise RecordError(f"{name}: it has gaps (NaN or infinite); fill or cut them first")
    largest = float(np.abs(samples).max())
    if largest > STRONGEST:
        raise RecordError(
            f"{name}: it reaches {plain(largest, 3)} m/s², more than any earthquake; accelerations are in m/s², "
            "1 gal is 0.01 m/s², 1 g is 9.80665 m/s²"
        )


@dataclass(frozen=True, slots=True)
class ToPga:
    """Scaling of a motion to a peak ground acceleration."""

    value: float
    """m/s², of the stronger horizontal component."""

    def __post_init__(self) -> None:
        _check_size("peak ground acceleration", self.value, STRONGEST, "m/s²")


@dataclass(frozen=True, slots=True)
class ToDisplacement:
    """Scaling of a motion until the model's isolators move this far."""

    value: float
    """m, largest displacement of the layer, in plan where both directions are computed."""

    def __post_init__(self) -> None:
        _check_size("displacement", self.value, FARTHEST, "m")


@dataclass(frozen=True, slots=True)
class ToSpectrum:
    """Scaling of a motion to a design spectrum."""

    periods: tuple[float, ...]
    """s, rising."""
    acceleration: tuple[float, ...]
    """m/s², at 5 % damping."""

    def __post_init__(self) -> None:
        known = np.array([*self.periods, *self.acceleration], dtype=float)
        if len(self.periods) != len(self.acceleration) or len(self.periods) < 2:
            raise RecordError("a design spectrum needs one acceleration for each of two or more periods")
        if not (np.isfinite(known).all() and (known > 0).all() and (np.diff(self.periods) > 0).all()):
            raise RecordError("a design spectrum needs rising periods and accelerations above zero")


Scaling = ToPga | ToDisplacement | ToSpectrum
FARTHEST = 10.0
"""m: no isolation layer moves farther."""


def _check_size(name: str, value: float, most: float, unit: str) -> None:
    if not (np.isfinite(value) and 0 < value <= most):
        raise RecordError(
            f"a motion cannot be scaled to a {name} of {value:g} {unit}; give one in 0 ... {most:g} {unit}"
        )


def to_pga(motion: GroundMotion, wanted: ToPga) -> float:
    """Factor by which a motion reaches a peak ground acceleration."""
    return wanted.value / motion.pga


def to_spectrum(motion: GroundMotion, wanted: ToSpectrum, period: float) -> float:
    """Factor by which a motion's spectrum agrees with a design spectrum about the building's period.

    The factor makes the mean ratio of the spectra 1, as the mean of logarithms over PERIODS. The motion's spectrum is
    the geometric mean of those of its horizontal components (5 % damping).

    Args:
        motion: of the ground.
        wanted: the design spectrum.
        period: s, of the building on its isolators.

    Raises:
        RecordError: the design spectrum does not reach these periods.
    """
    low, high = max(PERIODS[0] * period, wanted.periods[0]), min(PERIODS[1] * period, wanted.periods[-1])
    if not low < high:
        raise RecordError(
            f"the design spectrum is given from {wanted.periods[0]:g} to {wanted.periods[-1]:g} s; the building on its "
            f"isolators needs it within {PERIODS[0] * period:.3g} to {PERIODS[1] * period:.3g} s"
        )
    periods = np.geomspace(low, high, SPECTRAL_POINTS)
    design = np.exp(np.interp(np.log(periods), np.log(wanted.periods), np.log(wanted.acceleration)))
    own = [np.log(response_spectrum(one, motion.rate, periods)) for one in motion.horizontal.values()]
    return float(np.exp(np.mean(np.log(design) - np.mean(own, axis=0))))
