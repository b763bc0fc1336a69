"""What every estimator of the restoring force takes and gives."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Matrix, Vector
from core.building import FixedBaseModes
from core.errors import ModelError, RecordError
from core.estimators.error_spectrum import ErrorSpectrum
from core.estimators.reliance import Reliance
from core.estimators.storeys import StoreyStiffness
from core.identification.modes import Mode


@dataclass(frozen=True, slots=True, eq=False)
class InstrumentedSuperstructure:
    """The superstructure in one direction, and what was measured of it: all that an estimator may know."""

    rate: float
    """Hz."""
    base_acceleration: Vector
    """(n,) m/s², absolute, of the base slab."""
    floor_acceleration: Matrix
    """(measured, n) m/s², absolute, of the instrumented floors from the lowest to the roof."""
    measured: Indices
    """(measured,) which floors these are, 0 for the lowest floor above the base slab."""
    base_mass: float
    """kg."""
    floor_mass: Vector
    """(floors,) kg, from the lowest floor to the roof."""
    storey_stiffness: Vector | None = None
    """(floors,) N/m, or None: then proportional to the mass of the floor above (paper, section 5)."""


@dataclass(frozen=True, slots=True, eq=False)
class RestoringForce:
    """The isolation layer's restoring force; positive where the layer is displaced to the positive side."""

    estimator: str
    force: Vector
    """(n,) N, eq 10: rigid + modal."""
    rigid: Vector
    """(n,) N, inertia of the whole building moving as the base slab."""
    modal: Vector
    """(n,) N, inertia of the superstructure's motion relative to the base slab."""
    std: Vector
    """(n,) N, standard deviation, with what the superstructure's model may have wrong."""
    modes: tuple[Mode, ...]
    error: ErrorSpectrum | None = None
    """At which frequencies the force errs by `noise_std`, N²/Hz; None of an estimator that does not know."""
    reliance: Reliance | None = None
    """None of an estimator that does not judge itself."""
    superstructure: FixedBaseModes | None = None
    """All modes of the superstructure that was calibrated from the record; None where none was, or it tells less than
    interpolation does."""
    storeys: StoreyStiffness | None = None
    """Of the same superstructure against its design; None where there is none, or nobody gave a stiffness."""

    noise_std: Vector | None = None
    """(n,) N, standard deviation by the sensors' noise and by motion and parameters that the record leaves open. Models
    are fitted and compared by it: the rest of `std` is no noise, but wrong alike from sample to sample. It can exceed
    `std` where left-out floors show less unmodelled motion than the calibration allows for. None: `std`."""
    systematic: Matrix | None = None
    """(p, n) N, effect of one standard deviation of each of p independent errors that are alike from sample to sample.
    They are part of `std`, and of the deviations of k_eq and c_eq. None of an estimator that does not know them."""

    @property
    def fitting_std(self) -> Vector:
        """(n,) N, standard deviation by which models are fitted."""
        return self.std if self.noise_std is None else self.noise_std

    @property
    def peak(self) -> tuple[float, float]:
        """N, largest absolute force, and its standard deviation."""
        at = int(np.argmax(np.abs(self.force)))
        return float(abs(self.force[at])), float(self.std[at])


def check(superstructure: InstrumentedSuperstructure) -> None:
    """Refuses what no estimator can use.

    Raises:
        RecordError: the record holds gaps, or does not fit the floors it is said to be from.
        ModelError: a mass is not positive.
    """
    base, floors, measured = (
        superstructure.base_acceleration,
        superstructure.floor_acceleration,
        superstructure.measured,
    )
    if floors.shape != (measured.size, base.size):
        raise RecordError(
            f"floor accelerations of shape {floors.shape} do not fit "
            f"{measured.size} measured floors of {base.size} samples"
        )
    if not (np.isfinite(base).all() and np.isfinite(floors).all()):
        raise RecordError("accelerations hold gaps (NaN); a record without gaps, or without that channel, would do")
    if not (superstructure.base_mass > 0 and np.all(superstructure.floor_mass > 0)):
        raise ModelError("every mass must be positive")


Estimator = Callable[[InstrumentedSuperstructure], RestoringForce]
