"""What every estimator of the restoring force takes and gives."""

from collections.abc import Callable
from dataclasses import dataclass

from core.arrays import Indices, Matrix, Vector


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
class Mode:
    """One fixed-base mode of the superstructure."""

    frequency: float
    """Hz, undamped."""
    damping_ratio: float
    shape: Vector
    """(floors,) relative to the base slab, 1 at the highest measured floor."""
    frequency_std: float | None = None
    """Hz."""
    damping_ratio_std: float | None = None
    shape_std: Vector | None = None
    """(floors,) at floors without a sensor that of the measured ones carried through the expansion."""
    misfit: float | None = None
    """Chi-square per degree of freedom of the fit that allows for noise in every channel; 1 where noise explains all
    it leaves. Where there is no shape_std the fit was of no use, and the values are those of the subspace."""


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
    """(n,) N, standard deviation."""
    modes: tuple[Mode, ...]


Estimator = Callable[[InstrumentedSuperstructure], RestoringForce]
