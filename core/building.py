"""The shear building above the isolators: its matrices and fixed-base modes (paper, eq 1-4)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from core.arrays import Matrix, Vector
from core.errors import ModelError


@dataclass(frozen=True, slots=True, eq=False)
class ShearBuilding:
    """Base slab and shear superstructure; every array runs from the lowest floor to the roof."""

    base_mass: float
    """kg, of the slab just above the isolators (m_b)."""
    floor_mass: Vector
    """(floors,) kg."""
    storey_stiffness: Vector
    """(floors,) N/m, of the storey below each floor."""
    damping_coefficient: float
    """s, α of the stiffness-proportional damping C_s = α K_s."""

    def __post_init__(self) -> None:
        if (
            self.floor_mass.ndim != 1
            or self.floor_mass.shape != self.storey_stiffness.shape
            or not self.floor_mass.size
        ):
            raise ModelError(
                f"every floor has one mass and one storey below it, "
                f"got shapes {self.floor_mass.shape} and {self.storey_stiffness.shape}"
            )
        for name, values in (
            ("mass", np.append(self.floor_mass, self.base_mass)),
            ("stiffness", self.storey_stiffness),
        ):
            if not (values > 0).all():
                raise ModelError(f"every {name} must be positive, got {values.min():.3g}")
        if not self.damping_coefficient >= 0:
            raise ModelError(f"the damping coefficient must not be negative, got {self.damping_coefficient} s")

    @property
    def total_mass(self) -> float:
        """kg, tr(M) of eq 10: the base slab included."""
        return float(self.base_mass + self.floor_mass.sum())


@dataclass(frozen=True, slots=True, eq=False)
class FixedBaseModes:
    """Modes of the superstructure on a fixed base slab, by rising frequency (eq 3)."""

    angular_frequency: Vector
    """(modes,) rad/s, ω, undamped."""
    damping_ratio: Vector
    """(modes,) α ω / 2."""
    shape: Matrix
    """(floors, modes) kg^(-1/2), Φ_s, normalised to Φ_sᵀ M_s Φ_s = I."""

    @property
    def frequency(self) -> Vector:
        """(modes,) Hz."""
        return self.angular_frequency / (2 * np.pi)


def storey_stiffness_matrix(storey_stiffness: Vector) -> Matrix:
    """Stiffness matrix K_s of the superstructure on a fixed base (eq 2).

    Args:
        storey_stiffness: (floors,) N/m, from the lowest storey to the highest.

    Returns:
        (floors, floors) N/m, tridiagonal, symmetric and positive definite.
    """
    above = np.append(storey_stiffness[1:], 0.0)
    return np.diag(storey_stiffness + above) - np.diag(above[:-1], 1) - np.diag(above[:-1], -1)


def mass_matrix(building: ShearBuilding) -> Matrix:
    """Mass matrix M of the whole building, floors in order and the base slab last (eq 1).

    The paper counts its floors from the roof down; here they run from the lowest to the roof, as everywhere.

    Returns:
        (floors + 1, floors + 1) kg.
    """
    return np.diag(np.append(building.floor_mass, building.base_mass))


def stiffness_matrix(building: ShearBuilding, layer_stiffness: float) -> Matrix:
    """Stiffness matrix K of the whole building on a linear isolation layer (eq 1), ordered as `mass_matrix`.

    Args:
        building: the building.
        layer_stiffness: N/m, k_b.

    Returns:
        (floors + 1, floors + 1) N/m.
    """
    return _on_isolation_layer(building.storey_stiffness, layer_stiffness)


def damping_matrix(building: ShearBuilding, layer_damping: float) -> Matrix:
    """Damping matrix C of the whole building on a linear isolation layer (eq 1), ordered as `mass_matrix`.

    Args:
        building: the building; its storeys' dashpots are α times their stiffnesses.
        layer_damping: N s/m, c_b.

    Returns:
        (floors + 1, floors + 1) N s/m.
    """
    return _on_isolation_layer(building.damping_coefficient * building.storey_stiffness, layer_damping)


def fixed_base_modes(building: ShearBuilding) -> FixedBaseModes:
    """Fixed-interface normal modes of the superstructure: K_s φ = ω² M_s φ, with C_s = α K_s (eq 3-4)."""
    squared, shape = eigh(storey_stiffness_matrix(building.storey_stiffness), np.diag(building.floor_mass))
    angular_frequency = np.sqrt(squared)
    return FixedBaseModes(
        angular_frequency=angular_frequency,
        damping_ratio=building.damping_coefficient * angular_frequency / 2,
        shape=shape * np.where(shape[-1] < 0, -1.0, 1.0),  # the roof moves to the positive side in every mode
    )


def _on_isolation_layer(storeys: Vector, layer: float) -> Matrix:
    """Springs, or dashpots, in a chain: the layer below the base slab, the storeys above it."""
    matrix = np.zeros((storeys.size + 1, storeys.size + 1))
    matrix[:-1, :-1] = storey_stiffness_matrix(storeys)
    matrix[0, -1] = matrix[-1, 0] = -storeys[0]
    matrix[-1, -1] = storeys[0] + layer
    return matrix
