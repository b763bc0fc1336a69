"""Coverage and width of an analysis' 95 % bands."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from types import MappingProxyType

import numpy as np
from accuracy import STANDARD_DEVIATIONS, STRONG
from building_models import BASE, FOURTH, GROUND, LAYER, ROOF, paper, segments
from describing_function import cycle_errors
from exact_responses import (
    MOTIONS,
    SENSORS,
    as_prepared,
    bending,
    constant_modal_damping,
    paper_structure,
    random_floor_masses,
    random_masses,
)
from ground_motions import RATE
from hidden import building as hidden_building, ground as hidden_ground
from independent_simulation import LinearSuperstructure, independent_response
from real_building import inertia, superstructure
from scipy.linalg import eigh

import core
from core.analysis import AnalysisSettings, DirectionAnalysis, analyse
from core.arrays import Matrix, Vector
from core.building import storey_stiffness_matrix
from core.description import BuildingDescription
from core.estimates import ForceHistory
from core.estimators import ESTIMATORS
from core.paper import BUILDING
from core.signals.conditioning import without_baseline
from service.demo.earthquakes import Earthquake, prepared, recorded as demonstration_motions
from service.demo.scenario import BY_DESIGN, FOURTH_STOREY
from service.demo.site import SENSORS as DEMONSTRATION_SENSORS

GAL = 0.01
"""m/s²."""
DEMONSTRATION_PEAK = 100.0
"""gal, of the ground."""
DEMONSTRATION_NOISE = next(sensor.noise for sensor in DEMONSTRATION_SENSORS if sensor.quantity == "acceleration")
"""m/s²."""
CUT = 25.0
"""s, of a record that begins and ends in motion: the strongest."""


@dataclass(frozen=True, slots=True)
class Truth:
    """In what a building and its sensors differ from what an analysis may assume."""

    building: Callable[[int], LinearSuperstructure]
    """By the number of a draw."""
    levels_each: int = 1
    """Masses for each of the described floors."""
    gain_error: float = 0.0
    """Standard deviation of the accelerometers' gains; their common part scales the force as the total mass does."""
    pink: float = 0.0
    """Share of the noise's power that falls with frequency as 1/f."""
    other_motions: bool = False
    """True if the ground moves as in one of 72 other records."""
    cut: bool = False
    """True if the record begins and ends in motion."""
    mass_uncertainty: float = 0.0
    """Relative uncertainty of every level's mass, as the engineer gives it."""


def another_building(draw: int) -> LinearSuperstructure:
    """Masses, storeys and the damping of every mode at random, about the paper's; the total is the paper's."""
    drawn = hidden_building.building(np.random.default_rng([23, draw]), 0.1).superstructure
    K = storey_stiffness_matrix(drawn.storey_stiffness)
    squared, shape = eigh(K, np.diag(drawn.floor_mass))
    weighted = drawn.floor_mass[:, None] * shape
    damping = weighted @ np.diag(2 * drawn.damping_ratio * np.sqrt(squared)) @ weighted.T
    total = BUILDING.base_mass + BUILDING.floor_mass.sum()
    return LinearSuperstructure(total - float(drawn.floor_mass.sum()), drawn.floor_mass, K, damping)


def finer_storeys(draw: int, ratio: float = 0.03) -> LinearSuperstructure:
    """A mass at half height of every storey too, Rayleigh damping in the first and the third mode, uneven storeys."""
    rng = np.random.default_rng([29, draw])
    storeys = np.repeat(2 * BUILDING.storey_stiffness * (1 + 0.1 * rng.standard_normal(7)), 2)
    halves = np.repeat(BUILDING.floor_mass, 2) * np.tile([0.2, 0.8], 7)
    K = storey_stiffness_matrix(storeys)
    first, _, third = np.sqrt(eigh(K, np.diag(halves), eigvals_only=True)[:3])
    stiff = 2 * ratio / (first + third)
    return LinearSuperstructure(BUILDING.base_mass, halves, K, stiff * first * third * np.diag(halves) + stiff * K)


TRUTHS: Mapping[str, Truth] = MappingProxyType(
    {
        "in class": Truth(paper_structure),
        "constant modal damping 2 %": Truth(constant_modal_damping),
        "bending +20 %": Truth(bending),
        "floor masses ±20 %": Truth(random_floor_masses),
        "gains ±2 %": Truth(paper_structure, gain_error=0.02),
        "pink noise": Truth(paper_structure, pink=0.5),
        "finer storeys": Truth(finer_storeys, levels_each=2),
        "another building": Truth(another_building, gain_error=0.01, pink=0.5, other_motions=True),
        "cut in motion": Truth(paper_structure, cut=True),
        "all masses ±20 %": Truth(random_masses),
        "all masses ±20 %, as given": Truth(random_masses, mass_uncertainty=0.2),
    }
)
DRAWN = ("floor masses ±20 %", "finer storeys", "another building", "all masses ±20 %, as given")
"""Truths whose building differs from the described one by one random draw: many draws show what a band covers."""
NOISES = (0.01, 0.02, 0.05, 0.10)
PEAKS = (15.0, 70.0, 300.0)
"""gal, of the ground."""


@dataclass(frozen=True, slots=True)
class Case:
    """One record."""

    truth: str
    motion: str
    """One of truths.MOTIONS."""
    peak: float
    """gal."""
    noise: float
    """Standard deviation over the channel's root mean square."""
    seed: int


@dataclass(frozen=True, slots=True)
class Share:
    """Share of samples, or of cycles, within the 95 % band."""

    inside: float
    """Share within the band, from 0 to 1."""
    width: float
    """Root mean square of the standard deviation, over that of what happened."""
    error: float
    """Root mean square of the error, over that of what happened."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Shares of one analysis."""

    force: Share
    strong: Share
    """Share of the force, in strong motion."""
    displacement: Share | None
    cycles: int
    k_inside: int
    """Number of cycles within, by the describing function of the layer's law."""
    c_inside: int


@dataclass(frozen=True, slots=True, eq=False)
class ExactResponse:
    """Without error."""

    ground: Vector
    acceleration: Matrix
    """(1 + floors, n) m/s², of the described levels."""
    force: Vector
    displacement: Vector


@cache
def exact_response(name: str, motion: str, peak: float, draw: int) -> ExactResponse:
    """Exact response to a ground motion of that peak."""
    truth = TRUTHS[name]
    if truth.other_motions:
        index = [*MOTIONS].index(motion) + len(MOTIONS) * draw
        ground = hidden_ground.motion((7 * index + 3) % len(hidden_ground.MOTIONS), RATE)
    else:
        ground = MOTIONS[motion]()
    ground = ground * peak * GAL / np.abs(ground).max()
    found = independent_response(truth.building(draw), ground, RATE, 8)
    described = [0, *range(truth.levels_each, found.acceleration.shape[0], truth.levels_each)]
    kept = _strongest(found.acceleration[0]) if truth.cut else slice(None)
    return ExactResponse(
        ground[kept], found.acceleration[described][:, kept], found.force[kept], found.displacement[kept]
    )


def recorded(case: Case) -> dict[str, Vector]:
    """Channels with noise, by their names."""
    exact, truth = exact_response(case.truth, case.motion, case.peak, case.seed), TRUTHS[case.truth]
    rng = np.random.default_rng([31, case.seed, round(case.peak), [*MOTIONS].index(case.motion)])
    floors = [exact.acceleration[floor + 1] for floor in SENSORS]
    rows = [exact.ground, exact.acceleration[0], *floors, exact.displacement]
    gains = 1 + truth.gain_error * rng.standard_normal(4)
    gains = np.append(gains / np.median(gains[1:]), 1.0)
    pinks = [truth.pink] * 4 + [0.0]
    return {
        name: gain * row + case.noise * float(np.sqrt(np.mean(row**2))) * _noise(row.size, pink, rng)
        for name, row, gain, pink in zip((GROUND, BASE, FOURTH, ROOF, LAYER), rows, gains, pinks, strict=True)
    }


def coverage(case: Case, estimator: str = "smoother", *, transducer: bool = True) -> Coverage:
    """Shares of the analysis of a case, with or without a displacement transducer."""
    described, channels = _doubted(paper(), TRUTHS[case.truth].mass_uncertainty), recorded(case)
    if not transducer:
        channels.pop(LAYER)
        described = replace(described, channels=tuple(c for c in described.channels if c.id != LAYER))
    exact = exact_response(case.truth, case.motion, case.peak, case.seed)
    found = analyse(segments(channels), described, AnalysisSettings(estimator=estimator)).directions["x"]
    force = as_prepared(exact.force)
    strong = _strong(force)
    estimate, std = found.restoring_force.force, found.restoring_force.std
    return Coverage(
        share(force, estimate, std),
        share(force[strong], estimate[strong], std[strong]),
        _displacement(exact, found),
        *_cycles(exact, found),
    )


def _doubted(described: BuildingDescription, uncertainty: float) -> BuildingDescription:
    levels = (replace(level, mass_uncertainty=uncertainty) for level in described.levels)
    return replace(described, levels=tuple(levels))


def real_building_coverage(test: str, floors: tuple[str, ...], estimator: str = "smoother") -> Share:
    """Share of the force from the base slab and these floors."""
    found = ESTIMATORS[estimator](superstructure(test, floors))
    return share(inertia(test), found.force, found.std)


def demonstration_coverage(place: int) -> tuple[str, dict[str, tuple[Share, Share]]]:
    """A motion's name, and shares of the whole and of the strong part of the force in both directions.

    Args:
        place: of the motion among the demonstration's.
    """
    motion = demonstration_motions()[place]
    ground = prepared(motion, RATE, *BY_DESIGN.rest)
    ground *= DEMONSTRATION_PEAK * GAL / np.abs(ground).max()
    rng = np.random.default_rng([37, place])
    event = Earthquake(0, datetime(2024, 1, 1, tzinfo=UTC), motion.name, 1.0, 5e4)
    found = {}
    for direction, along in zip(("x", "y"), ground, strict=True):
        response = BY_DESIGN.response(along, event)
        base, floors = response.base_acceleration, response.floor_acceleration
        truth = _demonstration_force(base, floors, range(len(floors))).force
        noisy = [rows + DEMONSTRATION_NOISE * rng.standard_normal(rows.shape) for rows in (base, floors)]
        force = _demonstration_force(noisy[0], noisy[1], (FOURTH_STOREY, len(floors) - 1))
        strong = np.abs(truth) > 0.2 * np.abs(truth).max()
        whole = share(truth, force.force, force.std)
        found[direction] = whole, share(truth[strong], force.force[strong], force.std[strong])
    return motion.name, found


def _demonstration_force(base: Vector, floors: Matrix, measured: Sequence[int]) -> ForceHistory:
    masses = [BUILDING.base_mass, *BUILDING.floor_mass]
    return core.restoring_force(RATE, base=base, floors=floors[list(measured)], measured=measured, masses=masses)


def share(truth: Vector, estimate: Vector, std: Vector) -> Share:
    """Share of an estimate within its band."""
    scale, error = float(np.sqrt(np.mean(truth**2))), np.abs(estimate - truth)
    within = float(np.mean(error <= STANDARD_DEVIATIONS * std))
    return Share(within, float(np.sqrt(np.mean(std**2))) / scale, float(np.sqrt(np.mean(error**2))) / scale)


def _displacement(exact: ExactResponse, found: DirectionAnalysis) -> Share | None:
    if found.motion is None:
        return None
    return share(without_baseline(exact.displacement, RATE), found.motion.displacement, found.motion.displacement_std)


def _cycles(exact: ExactResponse, found: DirectionAnalysis) -> tuple[int, int, int]:
    if not found.equivalent:
        return 0, 0, 0
    counted = [s for s in found.equivalent if s.amplitude >= 0.1 * np.abs(exact.displacement).max()]
    if not counted:
        return 0, 0, 0
    error, std = np.moveaxis(cycle_errors(counted, float(np.abs(exact.displacement).max())), 1, 0)
    within = np.abs(error) <= STANDARD_DEVIATIONS * std
    return len(error), int(within[:, 0].sum()), int(within[:, 1].sum())


def _strong(force: Vector) -> slice:
    passed = np.cumsum(force**2)
    start, end = np.searchsorted(passed, np.array(STRONG) * passed[-1])
    return slice(int(start), int(end))


def _strongest(acceleration: Vector) -> slice:
    passed, count = np.cumsum(acceleration**2), round(CUT * RATE)
    start = int(np.argmax(passed[count:] - passed[:-count]))
    return slice(start, start + count)


def _noise(count: int, pink: float, rng: np.random.Generator) -> Vector:
    white, lines = rng.standard_normal(count), np.fft.rfft(rng.standard_normal(count))
    lines[1:] /= np.sqrt(np.arange(1, lines.size))
    lines[0] = 0.0
    falling = np.fft.irfft(lines, count)
    return np.asarray(np.sqrt(1 - pink) * white + np.sqrt(pink) * falling / falling.std())
