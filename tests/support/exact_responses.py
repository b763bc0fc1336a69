"""Exact responses of buildings like the paper's and unlike it, and what its sensors would have recorded of them.

An estimator always knows the paper's design: its masses, its floors, and no stiffness. Truths keep F = −Σ m_i a_i.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

import numpy as np
from ground_motions import RATE, akt013, chi_chi, delta, hector, kobe
from independent_simulation import LinearSuperstructure, independent_response
from scipy.linalg import eigh

from core.analysis import AnalysisSettings
from core.arrays import Matrix, Vector
from core.building import storey_stiffness_matrix
from core.estimators.superstructure import InstrumentedSuperstructure
from core.paper import BUILDING, FOURTH_STOREY
from core.signals.conditioning import Samples, band_passed, without_baseline

MOTIONS: Mapping[str, Callable[[], Vector]] = MappingProxyType(
    {"AKT013": akt013, "Kobe": kobe, "Chi-Chi": chi_chi, "Delta": delta, "Hector": hector}
)
"""Recorded ground motions, 70 gal, at rest before and after."""

BAND = AnalysisSettings().band
"""Hz, what the product passes on to its estimators."""

SENSORS = (FOURTH_STOREY, BUILDING.floor_mass.size - 1)
"""Floors with a sensor, besides the base slab."""

ENERGY = (0.05, 0.9)
"""Fractions of the energy of the base slab's motion at which a cut record begins and ends."""


@dataclass(frozen=True, slots=True, eq=False)
class ExactResponse:
    """Error-free response of a building."""

    acceleration: Matrix
    """(1 + floors, n) m/s², absolute, the base slab first."""
    force: Vector
    """(n,) N, of the isolation layer, equal to −Σ m_i a_i."""
    displacement: Vector
    """(n,) m, of the isolation layer."""
    velocity: Vector
    """(n,) m/s, of the isolation layer."""


@dataclass(frozen=True, slots=True)
class StructureKind:
    """In what the truth differs from what an estimator may assume."""

    building: Callable[[int], LinearSuperstructure]
    """The building by the number of a draw; those that are not random ignore it."""
    draws: int = 1
    """Number of draws."""
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Gains of the sensors on base slab, fourth storey and roof."""
    late: tuple[int, int, int] = (0, 0, 0)
    """Samples by which the same sensors are late."""
    cut: float | None = None
    """s, least length of a record that begins and ends in strong motion; None where it does so at rest."""


def paper_structure(_: int) -> LinearSuperstructure:
    """The paper's building: a shear chain with damping proportional to stiffness."""
    return _damped(_shear(), BUILDING.damping_coefficient * _shear())


def constant_modal_damping(_: int, ratio: float = 0.02) -> LinearSuperstructure:
    """The same damping ratio in every fixed-base mode."""
    mass, K = BUILDING.floor_mass, _shear()
    squared, shape = eigh(K, np.diag(mass))
    weighted = mass[:, None] * shape
    return _damped(K, weighted @ np.diag(2 * ratio * np.sqrt(squared)) @ weighted.T)


def rayleigh_damping(_: int, ratio: float = 0.02) -> LinearSuperstructure:
    """C = a M + b K with the given ratio in the first and the third fixed-base mode."""
    mass, K = np.diag(BUILDING.floor_mass), _shear()
    first, _second, third = np.sqrt(eigh(K, mass, eigvals_only=True)[:3])
    stiff = 2 * ratio / (first + third)
    return _damped(K, stiff * first * third * mass + stiff * K)


def bending(_: int, share: float = 0.2) -> LinearSuperstructure:
    """A uniform cantilever in series with the storeys makes the roof's static flexibility greater by a share."""
    flexibility = np.linalg.inv(_shear())
    height = np.arange(1.0, BUILDING.floor_mass.size + 1)
    low, high = np.minimum.outer(height, height), np.maximum.outer(height, height)
    cantilever = low**2 * (3 * high - low)
    K = np.linalg.inv(flexibility + share * flexibility[-1, -1] / cantilever[-1, -1] * cantilever)
    return _damped(K, BUILDING.damping_coefficient * K)


def random_floor_masses(draw: int, scatter: float = 0.2) -> LinearSuperstructure:
    """Floor masses scattered at random, their total the design's; base slab, stiffness and dashpots as designed."""
    drawn = BUILDING.floor_mass * (1 + scatter * np.random.default_rng([16, draw]).standard_normal(7))
    mass = drawn * BUILDING.floor_mass.sum() / drawn.sum()
    return LinearSuperstructure(BUILDING.base_mass, mass, _shear(), BUILDING.damping_coefficient * _shear())


def random_masses(draw: int, scatter: float = 0.2) -> LinearSuperstructure:
    """Every mass scattered at random, the base slab's too, the building's total the design's."""
    design = np.append(BUILDING.base_mass, BUILDING.floor_mass)
    drawn = design * (1 + scatter * np.random.default_rng([17, draw]).standard_normal(8))
    mass = drawn * design.sum() / drawn.sum()
    return LinearSuperstructure(float(mass[0]), mass[1:], _shear(), BUILDING.damping_coefficient * _shear())


IN_CLASS = StructureKind(paper_structure)
KINDS: Mapping[str, StructureKind] = MappingProxyType(
    {
        "in class": IN_CLASS,
        "cut in strong motion": StructureKind(paper_structure, cut=21.0),  # the shortest that the product filters: 20 s
        "cut to its strongest 15 s": StructureKind(paper_structure, cut=15.0),
        "constant modal damping 2 %": StructureKind(constant_modal_damping),
        "Rayleigh damping 2 %": StructureKind(rayleigh_damping),
        "bending +20 %": StructureKind(bending),
        "floor masses ±20 %": StructureKind(random_floor_masses, draws=8),
        "all masses ±20 %": StructureKind(random_masses, draws=8),
        "gain +2 %, base slab": StructureKind(paper_structure, gain=(1.02, 1.0, 1.0)),
        "gain +2 %, fourth storey": StructureKind(paper_structure, gain=(1.0, 1.02, 1.0)),
        "gain +2 %, roof": StructureKind(paper_structure, gain=(1.0, 1.0, 1.02)),
        "base slab a sample late": StructureKind(paper_structure, late=(1, 0, 0)),
        "fourth storey a sample late": StructureKind(paper_structure, late=(0, 1, 0)),
        "roof a sample late": StructureKind(paper_structure, late=(0, 0, 1)),
        "roof a sample early": StructureKind(paper_structure, late=(0, 0, -1)),
    }
)
"""All totals are right: the total mass cannot be identified from these sensors."""


@cache
def exact_response(kind: StructureKind, motion: str, draw: int = 0) -> ExactResponse:
    """The response for the whole record, or for the part that is kept."""
    found = independent_response(kind.building(draw % kind.draws), MOTIONS[motion](), RATE)
    kept = slice(None) if kind.cut is None else _strong(found.acceleration[0], kind.cut)
    return ExactResponse(found.acceleration[:, kept], found.force[kept], found.displacement[kept], found.velocity[kept])


def recorded(kind: StructureKind, motion: str, noise: float, seed: int) -> Matrix:
    """(3, n) m/s², absolute: base slab, fourth storey, roof, with faults and white noise.

    Args:
        kind: of the truth.
        motion: one of MOTIONS.
        noise: standard deviation over the channel's root mean square.
        seed: of the noise, and of the draw of what is random in the truth.
    """
    levels = [0, *(floor + 1 for floor in SENSORS)]
    exact = exact_response(kind, motion, seed % kind.draws).acceleration[levels]
    faulty = np.array([g * _delayed(row, n) for row, g, n in zip(exact, kind.gain, kind.late, strict=True)])
    rms = np.sqrt(np.mean(faulty**2, axis=1, keepdims=True))
    noisy: Matrix = faulty + noise * rms * np.random.default_rng([seed, 1]).standard_normal(faulty.shape)
    return noisy


def estimator_input(channels: Matrix) -> InstrumentedSuperstructure:
    """Input of an estimator, from (3, n) accelerations as of `recorded`."""
    return InstrumentedSuperstructure(
        RATE, channels[0], channels[1:], np.array(SENSORS), BUILDING.base_mass, BUILDING.floor_mass
    )


def as_prepared(samples: Samples) -> Samples:
    """Records after the product's preparation (core.sensors.preparation, instrumentation.py)."""
    rows = np.array([without_baseline(row, RATE) for row in np.atleast_2d(samples)])
    return band_passed(rows.reshape(samples.shape), RATE, BAND)


def _shear() -> Matrix:
    return storey_stiffness_matrix(BUILDING.storey_stiffness)


def _damped(stiffness: Matrix, damping: Matrix) -> LinearSuperstructure:
    return LinearSuperstructure(BUILDING.base_mass, BUILDING.floor_mass, stiffness, damping)


def _delayed(samples: Vector, late: int) -> Vector:
    return samples[np.clip(np.arange(samples.size) - late, 0, samples.size - 1)]


def _strong(base_acceleration: Vector, shortest: float) -> slice:
    passed = np.cumsum(base_acceleration**2)
    start, end = np.searchsorted(passed, np.array(ENERGY) * passed[-1])
    return slice(int(start), int(max(end, start + round(shortest * RATE))))
