"""Errors of the force beyond the sensors' noise: static interpolation between measured floors, and unknown masses."""

from dataclasses import replace

import numpy as np
import scipy

from core.arrays import ComplexMatrix, Matrix, Vector
from core.building import FixedBaseModes, ShearBuilding, fixed_base_modes
from core.estimators.result import RestoringForce
from core.estimators.substructure import assumed_stiffness, static_shapes
from core.estimators.superstructure import InstrumentedSuperstructure

DAMPING = 0.02
"""Damping ratio of the chain's modes. A choice."""
FIRST = (0.4, 8.0)
"""Hz, between which the chain's first fixed-base frequency lies. A choice."""
TRIED = 30
"""Number of frequencies tried between these, and then between the neighbours of the best. A choice."""
JUDGED = (0.2, 15.0)
"""Hz, band of the lines by which it is chosen."""
ENOUGH = 500
"""Lines by which it is chosen."""
UNEVEN = 1.25
"""Standard deviation of the interpolation's error over that of the chain; chosen on even seeds of
tests/support/band_coverage.py, on which it was 1 to 1.5."""
ENVELOPE = 2.0
"""s, over which the strength of the error is averaged. A choice."""


def interpolation_error(superstructure: InstrumentedSuperstructure, weights: Vector, noise: Vector) -> Vector:
    """(n,) N, effect of one standard deviation of the interpolation's error on the force.

    Args:
        superstructure: what was measured.
        weights: (1 + measured,) kg, by which the channels make the force.
        noise: (1 + measured,) m/s², standard deviation of the channels' noise.
    """
    series: Matrix = np.vstack([superstructure.base_acceleration, superstructure.floor_acceleration])
    if superstructure.measured.size == superstructure.floor_mass.size or not noise.all():
        return np.zeros(series.shape[1])
    frequency = np.asarray(np.fft.rfftfreq(series.shape[1], 1 / superstructure.rate), dtype=float)
    spectra = np.fft.rfft(series, axis=1)
    judged = np.flatnonzero((frequency > JUDGED[0]) & (frequency < JUDGED[1]))
    few = judged[:: max(1, judged.size // ENOUGH)]
    chain = _nearest_chain(superstructure, frequency[few], spectra[:, few] / noise[:, None], noise)
    floors = _motion(chain, superstructure, frequency)
    seen = np.vstack([np.ones(frequency.size), floors[superstructure.measured]]) / noise[:, None]
    amplitude = np.sum(seen.conj() * spectra / noise[:, None], axis=0) / np.sum(np.abs(seen) ** 2, axis=0)
    inertia = superstructure.base_mass + superstructure.floor_mass @ floors
    return np.asarray(UNEVEN * np.fft.irfft((inertia + (weights * noise) @ seen) * amplitude, series.shape[1]))


def variance_about(error: Vector, rate: float) -> Vector:
    """(n,) N², mean square of an (n,) error about each instant, at a rate in Hz."""
    window = scipy.signal.windows.hann(max(3, round(ENVELOPE * rate)))
    return np.asarray(np.maximum(scipy.signal.fftconvolve(error**2, window / window.sum(), mode="same"), 0.0))


def _nearest_chain(
    superstructure: InstrumentedSuperstructure, frequency: Vector, whitened: ComplexMatrix, noise: Vector
) -> FixedBaseModes:
    """The chain of the design's storeys, or the even one, at the frequency that explains most of the channels."""
    mass, stiffness = superstructure.floor_mass, superstructure.storey_stiffness
    storeys = np.ones_like(mass) if stiffness is None else stiffness
    shape = fixed_base_modes(ShearBuilding(superstructure.base_mass, mass, storeys, 0.0))

    def scaled(first: float) -> FixedBaseModes:
        angular = shape.angular_frequency * (2 * np.pi * first / shape.angular_frequency[0])
        return FixedBaseModes(angular, np.full_like(angular, DAMPING), shape.shape)

    def explained(first: float) -> float:
        floors = _motion(scaled(first), superstructure, frequency)[superstructure.measured]
        seen = np.vstack([np.ones(frequency.size), floors]) / noise[:, None]
        along = np.abs(np.sum(seen.conj() * whitened, axis=0)) ** 2 / np.sum(np.abs(seen) ** 2, axis=0)
        return float(along.sum())

    tried = np.geomspace(*FIRST, TRIED)
    best = int(np.argmax([explained(first) for first in tried]))
    finer = np.geomspace(tried[max(best - 1, 0)], tried[min(best + 1, TRIED - 1)], TRIED)
    return scaled(finer[int(np.argmax([explained(first) for first in finer]))])


def _motion(chain: FixedBaseModes, superstructure: InstrumentedSuperstructure, frequency: Vector) -> ComplexMatrix:
    """(floors, k) absolute acceleration of every floor by that of the base slab."""
    ω, own = 2 * np.pi * frequency, chain.angular_frequency[:, None]
    gain = ω**2 / (own**2 - ω**2 + 2j * chain.damping_ratio[:, None] * own * ω)
    load = chain.shape.T @ superstructure.floor_mass
    return np.asarray(1 + (chain.shape * load) @ gain)


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
