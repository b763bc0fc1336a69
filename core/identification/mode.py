"""What is known of one mode of a superstructure."""

from dataclasses import dataclass

from core.arrays import Vector


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
