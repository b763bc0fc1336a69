"""The superstructure that is calibrated from a record: its parameters, and what they make of it."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Indices, Matrix, Tensor, Vector
from core.building import storey_stiffness_matrix
from core.estimators.frame.frame import heights, lateral_stiffness


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each parameter stands in the vector of all; all but the last two kinds are logarithms."""

    floors: int
    channels: int

    @property
    def scale(self) -> int:
        """Of all stiffnesses, about those of the prior."""
        return 0

    @property
    def storeys(self) -> slice:
        """Step of the stiffness, over the design's, from the storey below to each; the lowest has none."""
        return slice(1, 1 + self.floors)

    @property
    def masses(self) -> slice:
        """Mass of each floor about the one told; only their distribution counts, their total stays."""
        return slice(1 + self.floors, 1 + 2 * self.floors)

    @property
    def flexibilities(self) -> slice:
        """Of the base slab's rocking, of the joints and of bending as a whole (core.estimators.frame.frame)."""
        return slice(1 + 2 * self.floors, 4 + 2 * self.floors)

    @property
    def damping(self) -> slice:
        """Coefficients of α K, i η K and β M."""
        return slice(4 + 2 * self.floors, 7 + 2 * self.floors)

    @property
    def modal_damping(self) -> slice:
        """Of each mode, by rising frequency, over what the coefficients make of it."""
        return slice(self.damping.stop, self.damping.stop + self.floors)

    @property
    def gains(self) -> slice:
        """Of every channel."""
        return slice(self.modal_damping.stop, self.modal_damping.stop + self.channels)

    @property
    def delays(self) -> slice:
        """s, of every channel."""
        return slice(self.gains.stop, self.gains.stop + self.channels)

    @property
    def transients(self) -> slice:
        """m/s² kg^½, two for each mode: what the record's start and end leave of the modes' free vibration."""
        return slice(self.delays.stop, self.delays.stop + 2 * self.floors)

    @property
    def size(self) -> int:
        """Of the whole vector."""
        return int(self.transients.stop)

    @property
    def structural(self) -> int:
        """How many of the first parameters are the structure's own."""
        return int(self.modal_damping.stop)


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """What is believed of the superstructure before any record."""

    floor_mass: Vector
    """(floors,) kg."""
    storey_stiffness: Vector
    """(floors,) N/m, scaled to a first fixed-base mode of 1 Hz; of equal columns where nobody gave a stiffness."""
    measured: Indices
    """(channels - 1,) floors with a sensor."""

    @classmethod
    def of(cls, floor_mass: Vector, storey_stiffness: Vector | None, measured: Indices) -> "Design":
        """From what an engineer gave."""
        stiffness = np.ones_like(floor_mass) if storey_stiffness is None else storey_stiffness
        lowest = linalg.eigh(
            storey_stiffness_matrix(stiffness), np.diag(floor_mass), eigvals_only=True, subset_by_index=[0, 0]
        )[0]
        return cls(floor_mass, stiffness * (2 * np.pi) ** 2 / lowest, measured)

    @property
    def layout(self) -> Layout:
        """Of the parameters."""
        return Layout(self.floor_mass.size, self.measured.size + 1)


@dataclass(frozen=True, slots=True, eq=False)
class Superstructure:
    """The fixed-base modes of one choice of parameters, normalised to unit modal mass, with their derivatives."""

    mass: Vector
    """(floors,) kg."""
    storey_stiffness: Vector
    """(floors,) N/m."""
    squared: Vector
    """(modes,) rad²/s²."""
    shapes: Matrix
    """(floors, modes)."""
    inputs: Matrix
    """(modes, 2 + floors) load by unit acceleration of the base slab, by its rocking, by a unit at each floor alone."""
    stiffness_derivatives: Tensor
    """(4 + floors, modes, modes) of the modal stiffness: by scale, storeys, rocking, joints and bending."""
    damping: Vector
    """(3,) α in s, η, β in 1/s."""
    modal_damping: Vector
    """(modes,) ρ: each mode is damped by so many times what α, η and β make of it."""

    @property
    def frequencies(self) -> Vector:
        """(modes,) Hz."""
        return np.asarray(np.sqrt(self.squared) / (2 * np.pi))

    @property
    def damping_ratios(self) -> Vector:
        """(modes,) of critical."""
        ω, (α, η, β) = np.sqrt(self.squared), self.damping
        return np.asarray(self.modal_damping * (α * ω / 2 + η / 2 + β / (2 * ω)))


def loads(floors: int) -> Matrix:
    """(2 + floors, floors) acceleration that each input is for the floors' mass: the base slab's, that of its rocking,
    and a unit at each floor alone."""
    return np.vstack([np.ones(floors), heights(floors), np.eye(floors)])


def rigid_motion(floors: int) -> Matrix:
    """(2 + floors, floors) what each input moves of a superstructure that does not deform."""
    return np.vstack([np.ones(floors), heights(floors), np.zeros((floors, floors))])


def superstructure(parameters: Vector, design: Design) -> Superstructure:
    """Modes of the frame with the given parameters, none damped by another (classical modes)."""
    layout = design.layout
    stiffness = design.storey_stiffness * np.exp(parameters[layout.scale] + np.cumsum(parameters[layout.storeys]))
    mass = design.floor_mass * np.exp(parameters[layout.masses])
    mass *= design.floor_mass.sum() / mass.sum()
    rocking, joints, bending = np.exp(parameters[layout.flexibilities])
    lateral = lateral_stiffness(stiffness, joints, rocking, bending)
    squared, shapes = linalg.eigh(lateral.stiffness, np.diag(mass))
    shapes = shapes * np.sign(shapes[-1])
    by_step = np.cumsum(lateral.by_storey[::-1], axis=0)[::-1]
    by = np.concatenate([[lateral.stiffness], by_step, [lateral.by_rocking, lateral.by_joints, lateral.by_bending]])
    return Superstructure(
        mass=mass,
        storey_stiffness=stiffness,
        squared=squared,
        shapes=shapes,
        inputs=shapes.T @ (mass[:, None] * loads(mass.size).T),
        stiffness_derivatives=shapes.T @ by @ shapes,
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
    stiffness, inertia = np.zeros((total, ω.size, ω.size)), np.zeros((total, ω.size, ω.size))
    stiffness[np.r_[: 1 + floors, 1 + 2 * floors : total]] = structure.stiffness_derivatives
    moved = np.diag(structure.mass) - np.outer(structure.mass, structure.mass) / structure.mass.sum()
    inertia[masses] = np.einsum("im,ki,in->kmn", structure.shapes, moved, structure.shapes)
    of_squared = np.einsum("kmm->km", stiffness) - structure.squared * np.einsum("kmm->km", inertia)
    apart = structure.squared - structure.squared[:, None] + np.diag(np.full(ω.size, np.inf))
    mixed = (stiffness - structure.squared * inertia) / apart
    mixed[:, np.arange(ω.size), np.arange(ω.size)] = -np.einsum("kmm->km", inertia) / 2
    of_ratios = structure.modal_damping * of_squared / (2 * ω) * (α / 2 - β / (2 * structure.squared))
    by_damping = structure.modal_damping * np.array([α * ω / 2, np.full(ω.size, η / 2), β / (2 * ω)])
    return (
        np.vstack([of_squared, np.zeros((3 + ω.size, ω.size))]),
        np.concatenate([structure.shapes @ mixed, np.zeros((3 + ω.size, floors, ω.size))]),
        np.vstack([of_ratios, by_damping, np.diag(structure.damping_ratios)]),
    )
