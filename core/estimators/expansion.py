"""Mode shapes at the floors without a sensor (paper, eq 20-21), and the modal acceleration (eq 23)."""

import numpy as np
from scipy import linalg

from core.arrays import Indices, Matrix, Vector
from core.building import storey_stiffness_matrix
from core.errors import ModelError


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
