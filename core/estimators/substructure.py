"""Component modes of the isolated building (paper, eq 5-10), and their expansion to all floors (eq 20-23).

Craig and Bampton's fixed-interface method (1968). Vectors of the whole building hold the floors in order and the base
slab last; hybrid coordinates hold the modal ones first and the base slab's displacement last.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Indices, Matrix, Vector
from core.building import (
    ShearBuilding,
    damping_matrix,
    fixed_base_modes,
    mass_matrix,
    stiffness_matrix,
    storey_stiffness_matrix,
)
from core.errors import ModelError


@dataclass(frozen=True, slots=True, eq=False)
class HybridEquations:
    """M* q'' + C* q' + K* q = -Φᵀ M r x_g'' - F_nl in hybrid coordinates q (eq 7, truncated eq 8)."""

    transformation: Matrix
    """(floors + 1, modes + 1) Φ: physical = Φ @ hybrid."""
    mass: Matrix
    """(modes + 1, modes + 1)."""
    damping: Matrix
    """(modes + 1, modes + 1)."""
    stiffness: Matrix
    """(modes + 1, modes + 1)."""
    influence: Vector
    """(modes + 1,) Φᵀ M r."""


def constraint_mode(floors: int) -> Vector:
    """(floors,) Ψ_s: where the floors go when the base slab moves by one: nothing else holds them, so all by one."""
    return np.ones(floors)


def ritz_transformation(shape: Matrix) -> Matrix:
    """Φ of eq 5: from modal coordinates and the base slab's displacement to the displacements of all levels.

    Args:
        shape: (floors, modes) fixed-base mode shapes Φ_s.

    Returns:
        (floors + 1, modes + 1).
    """
    floors, modes = shape.shape
    transformation = np.zeros((floors + 1, modes + 1))
    transformation[:floors, :modes] = shape
    transformation[:floors, modes] = constraint_mode(floors)
    transformation[floors, modes] = 1.0
    return transformation


def hybrid_equations(
    building: ShearBuilding, layer_stiffness: float, layer_damping: float, modes: int | None = None
) -> HybridEquations:
    """The equation of motion in hybrid coordinates: whole (eq 6-7), or with the first modes only (eq 8).

    Args:
        building: the building.
        layer_stiffness: N/m, k_b, the linear part of the isolation layer.
        layer_damping: N s/m, c_b.
        modes: how many are kept; None for all.

    Raises:
        ModelError: the building does not have so many modes.
    """
    shape = fixed_base_modes(building).shape
    kept = shape.shape[1] if modes is None else modes
    if not 1 <= kept <= shape.shape[1]:
        raise ModelError(f"the superstructure has 1 to {shape.shape[1]} modes to keep, got {kept}")
    transformation = ritz_transformation(shape[:, :kept])
    mass = mass_matrix(building)
    return HybridEquations(
        transformation=transformation,
        mass=transformation.T @ mass @ transformation,
        damping=transformation.T @ damping_matrix(building, layer_damping) @ transformation,
        stiffness=transformation.T @ stiffness_matrix(building, layer_stiffness) @ transformation,
        influence=transformation.T @ mass.diagonal(),
    )


def rigid_force(total_mass: float, base_acceleration: Vector) -> Vector:
    """Part of the restoring force that moves the building as if it were rigid: -tr(M) (x_b'' + x_g'') (eq 10).

    Args:
        total_mass: kg, base slab included.
        base_acceleration: (n,) m/s², absolute.

    Returns:
        (n,) N.
    """
    return -total_mass * base_acceleration


def modal_force(floor_mass: Vector, shape: Matrix, modal_acceleration: Matrix) -> Vector:
    """Part of the restoring force that bends the superstructure: -(M r_s)ᵀ Φ_s ξ'' (eq 10).

    The paper prints ξ' and, in its Figure 4, ξ; the modal acceleration is meant.

    Args:
        floor_mass: (floors,) kg.
        shape: (floors, modes) Φ_s.
        modal_acceleration: (modes, n) ξ''.

    Returns:
        (n,) N.
    """
    force: Vector = -(floor_mass @ shape) @ modal_acceleration
    return force


def assumed_stiffness(floor_mass: Vector) -> Vector:
    """Storey stiffness proportional to the mass of the floor above it (paper, section 5).

    Args:
        floor_mass: (floors,) kg, from the lowest floor to the roof.

    Returns:
        (floors,) in proportion only: an expansion does not depend on the scale.
    """
    return np.array(floor_mass, dtype=float)


def static_shapes(storey_stiffness: Vector, measured: Indices) -> Matrix:
    """Deflection of all floors when the measured ones are displaced by one unit each, in turn (eq 20-21).

    Guyan (1965): no inertia at the floors without a sensor, K_oo φ_o + K_oa φ_a = 0; the base slab is fixed.

    Args:
        storey_stiffness: (floors,) N/m or in proportion, of the storey below each floor.
        measured: (measured,) indices of the instrumented floors, 0 for the lowest; at least one.

    Returns:
        (floors, measured), the unit matrix at the measured rows.

    Raises:
        ModelError: a stiffness is not positive, or the floors are not a rising selection of those there are.
    """
    floors = len(storey_stiffness)
    if not np.all(storey_stiffness > 0):
        raise ModelError(f"storey stiffness must be positive, got {np.min(storey_stiffness):.3g} N/m")
    measured = np.asarray(measured, dtype=np.intp)
    if measured.size == 0 or measured[0] < 0 or measured[-1] >= floors or np.any(np.diff(measured) <= 0):
        raise ModelError(f"measured floors must rise within 0 ... {floors - 1}, got {measured.tolist()}")
    unmeasured = np.setdiff1d(np.arange(floors), measured)
    K = storey_stiffness_matrix(storey_stiffness)
    shapes = np.zeros((floors, measured.size))
    shapes[measured, np.arange(measured.size)] = 1.0
    if unmeasured.size:
        K_oo, K_oa = K[np.ix_(unmeasured, unmeasured)], K[np.ix_(unmeasured, measured)]
        shapes[unmeasured] = -linalg.solve(K_oo, K_oa, assume_a="pos")
    return shapes


def expanded(shapes: Matrix, storey_stiffness: Vector, measured: Indices) -> Matrix:
    """Mode shapes at all floors from those at the measured ones (eq 21).

    Args:
        shapes: (measured, modes) relative to the base slab.
        storey_stiffness: (floors,) as in `static_shapes`.
        measured: (measured,) as in `static_shapes`.

    Returns:
        (floors, modes), unchanged at the measured floors.
    """
    return static_shapes(storey_stiffness, measured) @ shapes


def modal_acceleration(shapes: Matrix, measured: Indices, relative_acceleration: Matrix) -> Matrix:
    """Modal coordinates' accelerations ξ'' by the pseudo-inverse over the measured rows (eq 23).

    Args:
        shapes: (floors, modes) expanded mode shapes.
        measured: (measured,) indices of the instrumented floors.
        relative_acceleration: (measured, n) m/s², relative to the base slab.

    Returns:
        (modes, n) m/s² for dimensionless shapes. Of more modes than sensors, the solution of least norm.
    """
    return np.asarray(linalg.pinv(shapes[measured]) @ relative_acceleration)
