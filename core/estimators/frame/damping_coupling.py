"""What do modes that are not damped alike do to each other when a superstructure's stiffness or mass change?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix
from core.estimators.frame.superstructure_model import Superstructure


@dataclass(frozen=True, slots=True, eq=False)
class DampingCoupling:
    """By each two modes, (modes, modes), r down, s across; λ = ω² and ρ as in superstructure_model.

    The derivative of a response Σ φ_r c_r L_r, with c_r = 1 / (λ_r - ω² + iρ_r (...)), by a change of the modal
    stiffness has at each two modes the quotient (c_r - c_s) / (λ_r - λ_s), by one of the modal mass that of λ c; these
    are what is left of them over c_r c_s. The diagonals are the limits of s towards r.
    """

    stiff: Matrix
    """(ρ_r λ_r - ρ_s λ_s) / (λ_r - λ_s), 1 where all are damped alike."""
    uneven: Matrix
    """(ρ_r - ρ_s) / (λ_r - λ_s), s²/rad²; 0 where all are damped alike."""
    crossed: Matrix
    """(ρ_s λ_r - ρ_r λ_s) / (λ_r - λ_s), 1 where all are damped alike."""


def damping_coupling(structure: Superstructure) -> DampingCoupling:
    """Of a superstructure's modes."""
    λ, ρ = structure.squared, structure.modal_damping
    apart = λ[:, None] - λ + np.eye(λ.size)
    stiff, uneven = ((one[:, None] - one) / apart for one in (ρ * λ, ρ))
    crossed = (ρ * λ[:, None] - ρ[:, None] * λ) / apart
    return DampingCoupling(stiff + np.diag(ρ), uneven, crossed + np.diag(ρ))
