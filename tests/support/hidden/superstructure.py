"""The building above the isolators as its fixed-base oscillators, and how they answer over one step."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, expm

from core.arrays import Matrix, Vector


@dataclass(frozen=True, slots=True, eq=False)
class Superstructure:
    """Base slab and floors, each mode of the fixed base with a damping of its own."""

    base_mass: float
    """kg."""
    floor_mass: Vector
    """(floors,) kg, from the lowest floor to the roof."""
    storey_stiffness: Vector
    """(floors,) N/m, of the storey below each floor."""
    damping_ratio: Vector
    """(floors,) of the fixed-base modes by rising frequency."""

    @property
    def total_mass(self) -> float:
        """kg."""
        return float(self.base_mass + self.floor_mass.sum())


@dataclass(frozen=True, slots=True, eq=False)
class Oscillators:
    """Mode by mode: q'' + 2ζω q' + ω² q = −L a_b, exact over a step in which a_b runs straight."""

    participation: Vector
    """(modes,) L, kg^½."""
    shape: Matrix
    """(floors, modes) kg^-½."""
    advance: Matrix
    """(modes, 2, 2) from (q, q') at the beginning of the step to those at its end."""
    pushed: Matrix
    """(modes, 2, 2) what a_b at the beginning and at the end add to them."""
    answer: Matrix
    """(modes, 2) q'' for q and q' of one; what a_b adds is −L."""


def oscillators(superstructure: Superstructure, h: float) -> Oscillators:
    """The fixed-base modes of a shear building (Craig and Bampton, 1968), stepped as Nigam and Jennings (1969) do."""
    above = np.append(superstructure.storey_stiffness[1:], 0.0)
    K = np.diag(superstructure.storey_stiffness + above) - np.diag(above[:-1], 1) - np.diag(above[:-1], -1)
    squared, shape = eigh(K, np.diag(superstructure.floor_mass))
    participation = shape.T @ superstructure.floor_mass
    answer = np.column_stack([-squared, -2 * superstructure.damping_ratio * np.sqrt(squared)])
    advance, pushed = np.zeros((squared.size, 2, 2)), np.zeros((squared.size, 2, 2))
    for mode, (stiffness, damping) in enumerate(answer):
        # the state, with a_b and its change over the step held beside it, has one matrix exponential (Van Loan, 1978)
        whole = np.zeros((4, 4))
        whole[:2] = [[0, 1, 0, 0], [stiffness, damping, -participation[mode], 0]]
        whole[2, 3] = 1 / h
        step = expm(whole * h)
        advance[mode] = step[:2, :2]
        pushed[mode] = np.column_stack([step[:2, 2] - step[:2, 3], step[:2, 3]])
    return Oscillators(participation, shape, advance, pushed, answer)
