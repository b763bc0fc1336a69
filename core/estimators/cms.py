"""The paper's estimator: the isolation layer's restoring force by component mode synthesis (eq 10, 21, 23)."""

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import IdentificationError
from core.estimators.model_error import interpolation_error, variance_about
from core.estimators.result import RestoringForce
from core.estimators.substructure import (
    assumed_stiffness,
    expanded,
    modal_acceleration,
    modal_force,
    rigid_force,
    static_shapes,
)
from core.estimators.superstructure import InstrumentedSuperstructure, check
from core.identification.identified_modes import Identification, IdentifiedMode, identified_modes
from core.identification.modes import Mode, real_shape
from core.identification.refinement import Refinement, refined
from core.signals.noise import flicker, noise_std, record_flicker

NAME = "cms"
"""Name of the estimator."""
LOWEST = 0.1
"""Hz, below which noise is assumed not to rise further: slower parts are filtered out of records."""


def estimate(superstructure: InstrumentedSuperstructure) -> RestoringForce:
    """Restoring force from the base slab's and any set of floors' accelerations, with or without the roof.

    The superstructure's modes are identified, expanded to all floors and inverted over the measured ones. Where a
    record holds fewer modes than there are sensors, static deflections that complete the measured motion replace
    those missing, so that what was measured is never thrown away: the force is then still F = -Σ m_i a_i over
    statically interpolated floors, as it is with enough modes. `modes` is the number identified, possibly zero.

    Raises:
        RecordError: the record holds gaps, is shorter than 10 s, or its shape does not fit the measured floors.
        ModelError: masses or stiffnesses are not positive, or a floor is measured that the building does not have.
    """
    check(superstructure)
    modes = fixed_base_modes(superstructure, Identification())
    shapes = completed(shape_matrix(modes, len(superstructure.floor_mass)), superstructure)
    return force_of_shapes(superstructure, shapes, modes)


def fixed_base_modes(superstructure: InstrumentedSuperstructure, identification: Identification) -> tuple[Mode, ...]:
    """The superstructure's identified modes, refined and expanded to all floors; none if the record holds none."""
    measured = superstructure.base_acceleration, superstructure.floor_acceleration, superstructure.rate
    try:
        identified = identified_modes(*measured, identification)
    except IdentificationError:
        return ()
    refinement = refined(identified, *measured, identification)
    return at_all_floors(refinement, superstructure)


def at_all_floors(refinement: Refinement, superstructure: InstrumentedSuperstructure) -> tuple[Mode, ...]:
    """The modes with their shapes expanded from the sensors to all floors (eq 21)."""
    expansion = static_shapes(_stiffness(superstructure), superstructure.measured)
    return tuple(_at_all_floors(mode, refinement.misfit, expansion) for mode in refinement.modes)


def _at_all_floors(mode: IdentifiedMode, misfit: float | None, expansion: Matrix) -> Mode:
    covariance = mode.shape_covariance
    return Mode(
        frequency=mode.frequency,
        damping_ratio=mode.damping_ratio,
        shape=expansion @ real_shape(mode.shape),
        frequency_std=None if mode.deviation is None else mode.deviation.frequency,
        damping_ratio_std=None if mode.deviation is None else mode.deviation.damping_ratio,
        shape_std=None if covariance is None else np.sqrt(np.sum((expansion @ covariance) * expansion, axis=1)),
        misfit=misfit,
    )


def shape_matrix(modes: tuple[Mode, ...], floors: int) -> Matrix:
    """(floors, modes) the modes' shapes side by side, perhaps none."""
    return np.array([mode.shape for mode in modes]).reshape(len(modes), floors).T


def completed(shapes: Matrix, superstructure: InstrumentedSuperstructure) -> Matrix:
    """Shapes that span every motion of the measured floors: those given, completed by static deflections.

    Args:
        shapes: (floors, modes) expanded mode shapes, perhaps none.
        superstructure: which floors are measured, and its stiffness.

    Returns:
        (floors, max(modes, measured) or more); the added ones are orthogonal at the sensors to those given.
    """
    measured = superstructure.measured
    missing = linalg.null_space(shapes[measured].T) if shapes.size else np.eye(measured.size)
    return np.hstack([shapes, expanded(missing, _stiffness(superstructure), measured)])


def force_of_shapes(
    superstructure: InstrumentedSuperstructure, shapes: Matrix, modes: tuple[Mode, ...]
) -> RestoringForce:
    """Restoring force from the modal accelerations of the given shapes, and of nothing else (eq 10 and 23).

    Args:
        superstructure: what was measured.
        shapes: (floors, k) expanded shapes relative to the base slab.
        modes: reported in the result.

    Returns:
        The force. Its standard deviation is that of the sensors' noise, flicker included, carried through the linear
        combination, and that of the inertia which the floors without a sensor have beside the interpolation; it does
        not cover errors in the masses' sum.
    """
    base, floors = superstructure.base_acceleration, superstructure.floor_acceleration
    modal_coordinates = modal_acceleration(shapes, superstructure.measured, floors - base)
    rigid = rigid_force(superstructure.base_mass + superstructure.floor_mass.sum(), base)
    modal = modal_force(superstructure.floor_mass, shapes, modal_coordinates)
    weights, noise = channel_weights(superstructure, shapes), _noise(superstructure)
    by_noise = float(np.sum((weights * noise) ** 2))
    unseen = interpolation_error(superstructure, weights, noise)
    return RestoringForce(
        estimator=NAME,
        force=rigid + modal,
        rigid=rigid,
        modal=modal,
        std=np.sqrt(by_noise + variance_about(unseen, superstructure.rate)),
        modes=modes,
        noise_std=np.full(base.size, np.sqrt(by_noise)),
        systematic=unseen[None],
    )


def channel_weights(superstructure: InstrumentedSuperstructure, shapes: Matrix) -> Vector:
    """The force as a linear combination of the channels.

    Returns:
        (1 + measured,) kg, the base slab's weight first: F = weights @ [a_b; a_measured].
    """
    floors = -(superstructure.floor_mass @ shapes) @ linalg.pinv(shapes[superstructure.measured])
    total = superstructure.base_mass + superstructure.floor_mass.sum()
    return np.concatenate([[-total - floors.sum()], floors])


def _noise(superstructure: InstrumentedSuperstructure) -> Vector:
    """(1 + measured,) m/s², standard deviation of the channels' noise, white and flicker."""
    series, rate = np.vstack([superstructure.base_acceleration, superstructure.floor_acceleration]), superstructure.rate
    white = noise_std(series, rate)
    frequency = np.asarray(np.fft.rfftfreq(series.shape[1], 1 / rate), dtype=float)
    rising = flicker(np.maximum(frequency, LOWEST), record_flicker(series, rate))
    return np.asarray(white * np.sqrt(np.mean(rising)))


def _stiffness(superstructure: InstrumentedSuperstructure) -> Vector:
    if superstructure.storey_stiffness is None:
        return assumed_stiffness(superstructure.floor_mass)
    return superstructure.storey_stiffness
