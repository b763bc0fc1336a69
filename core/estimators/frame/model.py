"""The frame that is calibrated from a record: its parameters, its lateral stiffness and its fixed-base modes.

The joints rotate, the base slab rocks, and the frame bends as a whole.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy import linalg

from core.arrays import Indices, Matrix, Tensor, Vector
from core.building import storey_stiffness_matrix

COLUMN = (
    np.array([[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]]) / 12
)
"""Stiffness matrix of a prismatic column by the displacements and (times the storey's height) rotations of its two
ends, relative to its stiffness with both ends clamped."""
STIFFEST_JOINTS = 1e-9
"""Smallest flexibility of the joints: their stiffness has to be finite. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class StiffnessDerivatives:
    """Derivatives of the lateral stiffness, N/m, by logarithms."""

    by_storey: Tensor
    """(floors, floors, floors) first index: by that storey's stiffness."""
    by_joints: Matrix
    """(floors, floors) by the joints' flexibility."""
    by_rocking: Matrix
    """(floors, floors) by the rocking flexibility."""
    by_bending: Matrix
    """(floors, floors) by the bending flexibility."""


@dataclass(frozen=True, slots=True, eq=False)
class LateralStiffness:
    """Stiffness of the floors relative to the base slab's translation."""

    stiffness: Matrix
    """(floors, floors) N/m."""
    storey_stiffness: Vector
    """(floors,) N/m, of the columns with both ends clamped."""
    joints: float
    """Their flexibility, as in `lateral_stiffness`."""
    rocking: float
    """Flexibility, as there."""
    bending: float
    """Flexibility, as there."""
    condensation: Matrix
    """(2 floors, floors) translations and rotations of the joints by the floors' translations."""
    flexibility: Matrix
    """(floors, floors) m/N, of the frame on a base that does not rotate."""

    def derivatives(self) -> StiffnessDerivatives:
        """Derivatives by every storey's stiffness and by the flexibilities."""
        columns, girders = _scaled_parts(self.storey_stiffness, self.joints)
        by_column = self.condensation.T @ (columns + girders) @ self.condensation
        by_joints = -self.condensation.T @ girders.sum(axis=0) @ self.condensation
        floors, storeys = self.storey_stiffness.size, float(np.sum(1 / self.storey_stiffness))
        through, turned = self.stiffness @ self.flexibility, self.stiffness @ heights(floors)
        by_rocking = -self.rocking * storeys * np.outer(turned, turned)
        by_bending = -self.bending * storeys * self.stiffness @ cantilever(floors) @ self.stiffness
        share = (1 / self.storey_stiffness) / storeys
        by_storey = through @ by_column @ through.T - share[:, None, None] * (by_rocking + by_bending)
        return StiffnessDerivatives(by_storey, through @ by_joints @ through.T, by_rocking, by_bending)


@cache
def heights(floors: int) -> Vector:
    """(floors,) height of each above the base slab over that of the roof, storeys being alike."""
    return np.arange(1, floors + 1) / floors


@cache
def turning(floors: int) -> Matrix:
    """(floors, floors) flexibility of a base that rotates under a rigid frame, 1 at the roof."""
    return np.outer(heights(floors), heights(floors))


@cache
def cantilever(floors: int) -> Matrix:
    """(floors, floors) flexibility of a uniform cantilever that bends as a whole, 1 at the roof."""
    low, high = np.minimum.outer(heights(floors), heights(floors)), np.maximum.outer(heights(floors), heights(floors))
    return np.asarray(low**2 * (3 * high - low) / 2)


def lateral_stiffness(storey_stiffness: Vector, joints: float, rocking: float, bending: float) -> LateralStiffness:
    """Frame of equal storeys whose girders clamp the columns' ends in part, in series with a rocking base and with a
    cantilever's bending, which the columns' axial deformation causes.

    With rigid joints (joints = 0) and no rocking it is the shear building of eq 1; with soft joints it bends as a
    cantilever. The joints' rotations carry no mass and are condensed (Guyan 1965).

    Args:
        storey_stiffness: (floors,) N/m, of the columns below each floor, both ends clamped.
        joints: stiffness of the columns over that of the girders at a joint (the inverse of Blume's joint rotation
            index, 1968), >= 0.
        rocking: deflection of the roof by the base slab's rotation over that by the storeys, both under one
            horizontal force on the roof.
        bending: the same of the bending as a whole.
    """
    joints = max(joints, STIFFEST_JOINTS)
    columns, girders = _parts(floors := storey_stiffness.size)
    whole = (storey_stiffness @ (columns + girders / joints).reshape(floors, -1)).reshape(2 * floors, -1)
    condensation = np.eye(2 * floors, floors)
    condensation[floors:] = -_solution(whole[floors:, floors:], whole[floors:, :floors])
    flexibility = _solution(condensation.T @ whole @ condensation, np.eye(floors))
    storeys = float(np.sum(1 / storey_stiffness))
    beside = rocking * turning(floors) + bending * cantilever(floors)
    stiffness = _solution(flexibility + storeys * beside, np.eye(floors))
    return LateralStiffness(stiffness, storey_stiffness, joints, rocking, bending, condensation, flexibility)


def _solution(matrix: Matrix, right: Matrix) -> Matrix:
    """Solution with a positive definite matrix by LAPACK itself: numpy's checks take longer for so few floors.

    Raises:
        LinAlgError: the matrix is not positive definite.
    """
    _, solution, status = linalg.lapack.dposv(matrix, right)
    if status:
        raise np.linalg.LinAlgError("a stiffness matrix of the frame is not positive definite")
    return np.asarray(solution)


def _scaled_parts(storey_stiffness: Vector, joints: float) -> tuple[Tensor, Tensor]:
    """(floors, 2 floors, 2 floors) N/m of each storey's columns and of its girders; see `_parts`."""
    columns, girders = _parts(storey_stiffness.size)
    scale = storey_stiffness[:, None, None]
    return scale * columns, scale * girders / joints


@cache
def _parts(floors: int) -> tuple[Tensor, Tensor]:
    """(floors, 2 floors, 2 floors) what the columns of each storey, and the girders they size, add to the stiffness of
    translations and rotations, for columns and joints of unit stiffness."""
    columns = np.zeros((floors, 2 * floors + 2, 2 * floors + 2))
    girders = np.zeros_like(columns)
    for storey in range(floors):
        ends = np.array([storey, floors + 1 + storey, storey + 1, floors + 2 + storey])
        columns[storey][np.ix_(ends, ends)] = COLUMN
        # a girder is as stiff as the mean of the columns above and below it; the roof's as its one column
        girders[storey, ends[3], ends[3]] = 1.0 if storey == floors - 1 else 0.5
        girders[storey, ends[1], ends[1]] = 0.5 if storey else 0.0
    free = np.delete(np.arange(2 * floors + 2), [0, floors + 1])
    return columns[:, free][:, :, free], girders[:, free][:, :, free]


@dataclass(frozen=True)  # without slots, for the cached properties
class Layout:
    """Positions of the parameters in one vector; all but the last two kinds are logarithms."""

    floors: int
    channels: int

    @cached_property
    def scale(self) -> int:
        """Scale of all stiffnesses relative to the prior's."""
        return 0

    @cached_property
    def storeys(self) -> slice:
        """Step of the stiffness, over the design's, from the storey below to each; the lowest has none."""
        return slice(1, 1 + self.floors)

    @cached_property
    def masses(self) -> slice:
        """Mass of each floor relative to the given one; only their distribution counts, their total stays."""
        return slice(1 + self.floors, 1 + 2 * self.floors)

    @cached_property
    def flexibilities(self) -> slice:
        """Flexibilities of the base slab's rocking, of the joints and of bending as a whole."""
        return slice(1 + 2 * self.floors, 4 + 2 * self.floors)

    @cached_property
    def damping(self) -> slice:
        """Coefficients of α K, i η K and β M."""
        return slice(4 + 2 * self.floors, 7 + 2 * self.floors)

    @cached_property
    def modal_damping(self) -> slice:
        """Damping of each mode, by rising frequency, over what the coefficients give it."""
        return slice(self.damping.stop, self.damping.stop + self.floors)

    @cached_property
    def gains(self) -> slice:
        """Gain of every channel."""
        return slice(self.modal_damping.stop, self.modal_damping.stop + self.channels)

    @cached_property
    def delays(self) -> slice:
        """s, clock delay of every channel."""
        return slice(self.gains.stop, self.gains.stop + self.channels)

    @cached_property
    def transients(self) -> slice:
        """m/s² kg^½, two for each mode: free vibration that the record's start and end leave."""
        return slice(self.delays.stop, self.delays.stop + 2 * self.floors)

    @cached_property
    def size(self) -> int:
        """Length of the whole vector."""
        return int(self.transients.stop)

    @cached_property
    def structural(self) -> int:
        """Number of the structure's own parameters, which come first."""
        return int(self.modal_damping.stop)


@dataclass(frozen=True, eq=False)  # without slots, for the cached property
class Design:
    """Prior knowledge of the superstructure."""

    floor_mass: Vector
    """(floors,) kg."""
    storey_stiffness: Vector
    """(floors,) N/m, scaled to a first fixed-base mode of 1 Hz; of equal columns where no stiffness is given."""
    measured: Indices
    """(channels - 1,) floors with a sensor."""

    @classmethod
    def of(cls, floor_mass: Vector, storey_stiffness: Vector | None, measured: Indices) -> "Design":
        """Design from the building file's masses and stiffnesses."""
        stiffness = np.ones_like(floor_mass) if storey_stiffness is None else storey_stiffness
        lowest = linalg.eigh(
            storey_stiffness_matrix(stiffness), np.diag(floor_mass), eigvals_only=True, subset_by_index=[0, 0]
        )[0]
        return cls(floor_mass, stiffness * (2 * np.pi) ** 2 / lowest, measured)

    @cached_property
    def layout(self) -> Layout:
        """Layout of the parameters."""
        return Layout(self.floor_mass.size, self.measured.size + 1)


@dataclass(frozen=True, eq=False)  # without slots, for the cached property
class Superstructure:
    """The fixed-base modes of one choice of parameters, normalised to unit modal mass, with their derivatives."""

    mass: Vector
    """(floors,) kg."""
    lateral: LateralStiffness
    squared: Vector
    """(modes,) rad²/s²."""
    shapes: Matrix
    """(floors, modes)."""
    inputs: Matrix
    """(modes, 2 + floors) load by unit acceleration of the base slab, by its rocking, by a unit at each floor alone."""
    damping: Vector
    """(3,) α in s, η, β in 1/s."""
    modal_damping: Vector
    """(modes,) ρ, factor on the damping that α, η and β give each mode."""

    @cached_property
    def stiffness_derivatives(self) -> Tensor:
        """(4 + floors, modes, modes) of the modal stiffness: by scale, storeys, rocking, joints and bending."""
        by = self.lateral.derivatives()
        by_step = np.cumsum(by.by_storey[::-1], axis=0)[::-1]
        flexibilities = [by.by_rocking, by.by_joints, by.by_bending]
        by_parameter = np.concatenate([[self.lateral.stiffness], by_step, flexibilities])
        half = by_parameter.reshape(-1, self.mass.size) @ self.shapes
        return np.asarray(self.shapes.T @ half.reshape(by_parameter.shape))

    @cached_property
    def changes(self) -> tuple[Matrix, Tensor, Matrix]:
        """Derivatives of the modes; see `modal_changes`."""
        return modal_changes(self)

    @property
    def frequencies(self) -> Vector:
        """(modes,) Hz."""
        return np.asarray(np.sqrt(self.squared) / (2 * np.pi))

    @property
    def damping_ratios(self) -> Vector:
        """(modes,) of critical."""
        ω, (α, η, β) = np.sqrt(self.squared), self.damping
        return np.asarray(self.modal_damping * (α * ω / 2 + η / 2 + β / (2 * ω)))


@cache
def loads(floors: int) -> Matrix:
    """(2 + floors, floors) acceleration that each input is for the floors' mass: the base slab's, that of its rocking,
    and a unit at each floor alone."""
    return np.vstack([np.ones(floors), heights(floors), np.eye(floors)])


@cache
def rigid_motion(floors: int) -> Matrix:
    """(2 + floors, floors) rigid motion of the floors by each input."""
    return np.vstack([np.ones(floors), heights(floors), np.zeros((floors, floors))])


def superstructure(parameters: Vector, design: Design) -> Superstructure:
    """Modes of the frame with the given parameters, none damped by another (classical modes)."""
    layout = design.layout
    stiffness = design.storey_stiffness * np.exp(parameters[layout.scale] + np.cumsum(parameters[layout.storeys]))
    mass = design.floor_mass * np.exp(parameters[layout.masses])
    mass *= design.floor_mass.sum() / mass.sum()
    rocking, joints, bending = np.exp(parameters[layout.flexibilities])
    lateral = lateral_stiffness(stiffness, float(joints), float(rocking), float(bending))
    root = np.sqrt(mass)
    squared, vectors = np.linalg.eigh(lateral.stiffness / (root[:, None] * root))
    shapes = vectors / root[:, None] * np.sign(vectors[-1])
    return Superstructure(
        mass=mass,
        lateral=lateral,
        squared=squared,
        shapes=shapes,
        inputs=shapes.T @ (mass[:, None] * loads(mass.size).T),
        damping=np.exp(parameters[layout.damping]),
        modal_damping=np.exp(parameters[layout.modal_damping]),
    )


def modal_changes(structure: Superstructure) -> tuple[Matrix, Tensor, Matrix]:
    """Derivatives of the modes by the structure's parameters, in the order of Layout (Fox and Kapoor 1968).

    Returns:
        (structural, modes) rad²/s² of the squared frequencies, (structural, floors, modes) of the shapes, and
        (structural, modes) of the damping ratios.
    """
    floors, ω, (α, η, β) = structure.mass.size, np.sqrt(structure.squared), structure.damping
    total = 4 + 2 * floors
    masses = slice(1 + floors, 1 + 2 * floors)
    moved = np.diag(structure.mass) - structure.mass[:, None] * (structure.mass / structure.mass.sum())
    inertia = structure.shapes.T @ (moved[:, :, None] * structure.shapes)
    change, diagonal = np.empty((total, ω.size, ω.size)), np.arange(ω.size)
    change[: 1 + floors] = structure.stiffness_derivatives[: 1 + floors]
    change[masses] = -structure.squared * inertia
    change[1 + 2 * floors :] = structure.stiffness_derivatives[1 + floors :]
    of_squared = change[:, diagonal, diagonal]
    apart = structure.squared - structure.squared[:, None]
    apart[diagonal, diagonal] = np.inf
    mixed = change / apart
    mixed[masses, diagonal, diagonal] = -inertia[:, diagonal, diagonal] / 2
    of_ratios = structure.modal_damping * of_squared / (2 * ω) * (α / 2 - β / (2 * structure.squared))
    by_damping = structure.modal_damping * np.array([α * ω / 2, np.full(ω.size, η / 2), β / (2 * ω)])
    return (
        np.vstack([of_squared, np.zeros((3 + ω.size, ω.size))]),
        np.concatenate([structure.shapes @ mixed, np.zeros((3 + ω.size, floors, ω.size))]),
        np.vstack([of_ratios, by_damping, np.diag(structure.damping_ratios)]),
    )
