"""Error of the force by masses that are not known exactly.

The force is F = -Σ m_i a_i. An error of the total mass scales it, and with it k_eq, in every event alike. No
acceleration shows it, and no band holds it. An error of the masses' distribution at a right total changes the force by
the levels' motion relative to their mean. How well each mass is known, only the engineer can say.
"""

from dataclasses import replace

import numpy as np

from core.arrays import Matrix, Vector
from core.estimators.estimator import InstrumentedSuperstructure, RestoringForce
from core.estimators.expansion import assumed_stiffness, static_shapes


def with_mass_errors(
    force: RestoringForce, superstructure: InstrumentedSuperstructure, uncertainty: Vector
) -> RestoringForce:
    """The same force, its standard deviation enlarged by errors of the masses; models are fitted as before.

    Args:
        force: estimated from the superstructure's record.
        superstructure: what was measured.
        uncertainty: (1 + floors,) standard deviation of each mass over the mass, the base slab's first; independent of
            each other but for the total, which is right.
    """
    if not uncertainty.any():
        return force
    mass = np.append(superstructure.base_mass, superstructure.floor_mass)
    acceleration = _all_levels(superstructure)
    errors = -(uncertainty * mass)[:, None] * (acceleration - mass @ acceleration / mass.sum())
    known = np.zeros((0, force.force.size)) if force.systematic is None else force.systematic
    return replace(
        force,
        std=np.sqrt(force.std**2 + np.sum(errors**2, axis=0)),
        noise_std=force.fitting_std,
        systematic=np.vstack([known, errors[uncertainty > 0]]),
    )


def _all_levels(superstructure: InstrumentedSuperstructure) -> Matrix:
    """(1 + floors, n) m/s², floors without a sensor by static interpolation."""
    given, base = superstructure.storey_stiffness, superstructure.base_acceleration
    stiffness = assumed_stiffness(superstructure.floor_mass) if given is None else given
    shapes = static_shapes(stiffness, superstructure.measured)
    return np.vstack([base, base + shapes @ (superstructure.floor_acceleration - base)])
