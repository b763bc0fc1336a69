"""Spectral lines of a record whose superstructure is known: its response by solving at every line, without modes."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.building import storey_stiffness_matrix
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design, heights, lateral_stiffness
from core.paper import BUILDING

RATE = 100.0
SAMPLES = 6000
BANDS = np.geomspace(0.3, 25.0, 8)
"""Hz, between the bands of the variances."""
DESIGN = Design.of(BUILDING.floor_mass, None, np.array([2, 6]))
"""Prior knowledge of the paper's building: masses and two floors with a sensor."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownSuperstructure:
    """A superstructure on a base slab that may rock."""

    mass: Vector
    """(floors,) kg."""
    stiffness: Matrix
    """(floors, floors) N/m."""
    damping: tuple[float, float, float]
    """α in s, η, β in 1/s of α K, i η K and β M."""
    modal_damping: tuple[float, ...] | None = None
    """Damping of each mode, by rising frequency, relative to that of the coefficients; None if equal to it."""


PAPER = KnownSuperstructure(
    BUILDING.floor_mass,
    storey_stiffness_matrix(BUILDING.storey_stiffness),
    (BUILDING.damping_coefficient, 0.0, 0.0),
)


def known_superstructure(parameters: Vector, design: Design) -> KnownSuperstructure:
    """The superstructure of parameters, in words of the docstrings of core.estimators.frame.model."""
    layout = design.layout
    stiffness = design.storey_stiffness * np.exp(parameters[layout.scale] + np.cumsum(parameters[layout.storeys]))
    mass = design.floor_mass * np.exp(parameters[layout.masses])
    rocking, joints, bending = np.exp(parameters[layout.flexibilities])
    α, η, β = np.exp(parameters[layout.damping])
    lateral = lateral_stiffness(stiffness, float(joints), float(rocking), float(bending)).stiffness
    own = tuple(np.exp(parameters[layout.modal_damping]))
    return KnownSuperstructure(
        mass * design.floor_mass.sum() / mass.sum(), lateral, (float(α), float(η), float(β)), own
    )


def base_response(known: KnownSuperstructure, angular: Vector, rigid: Vector) -> ComplexMatrix:
    """(floors, lines) accelerations by a unit of the base's that moves the floors rigidly as (floors,) says."""
    mass, (α, η, β) = np.diag(known.mass), known.damping
    squared, shapes = eigh(known.stiffness, mass)
    own = np.ones(squared.size) if known.modal_damping is None else np.array(known.modal_damping)
    modal = mass @ shapes
    found = np.zeros((known.mass.size, angular.size), dtype=complex)
    for line, ω in enumerate(angular):
        dissipation = modal * (own * (squared * (ω * α + η) + ω * β)) @ modal.T
        dynamic = known.stiffness - ω**2 * mass + 1j * dissipation
        found[:, line] = rigid + ω**2 * np.linalg.solve(dynamic, known.mass * rigid)
    return found


def exact_lines(
    known: KnownSuperstructure,
    rng: np.random.Generator,
    band: tuple[float, float] = (0.2, 15.0),
    samples: int = SAMPLES,
) -> Lines:
    """Base slab of unit power at every line, floors as it drives them; `noise` is still to be set."""
    frequency = np.fft.rfftfreq(samples, 1 / RATE)
    inside = (frequency > band[0]) & (frequency < band[1])
    angular = np.asarray(2 * np.pi * frequency[inside], dtype=float)
    base = white_noise(angular.size, rng)
    floors = base_response(known, angular, np.ones(known.mass.size))[DESIGN.measured] * base
    return Lines(
        angular=angular,
        spectra=np.vstack([base, floors]),
        noise=np.zeros(DESIGN.layout.channels),
        colour=np.ones(angular.size),
        band=np.digitize(frequency[inside], BANDS),
        samples=samples,
        rate=RATE,
        at_rest=True,
    )


def with_rocking(lines: Lines, known: KnownSuperstructure, share: float, rng: np.random.Generator) -> Lines:
    """The same with rocking of its own, as acceleration at the roof over that of the base slab."""
    motion = share * white_noise(lines.angular.size, rng)
    floors = base_response(known, lines.angular, heights(known.mass.size))[DESIGN.measured] * motion
    return replace(lines, spectra=lines.spectra + np.vstack([np.zeros_like(motion), floors]))


def with_noise(lines: Lines, share: float, rng: np.random.Generator) -> Lines:
    """With noise of a share of every channel's root mean square, and that known."""
    power = share**2 * np.mean(np.abs(lines.spectra) ** 2, axis=1)
    drawn = np.array([np.sqrt(each) * white_noise(lines.angular.size, rng) for each in power])
    return replace(lines, spectra=lines.spectra + drawn, noise=power)


def with_sensor_fault(lines: Lines, channel: int, gain: float, late: float) -> Lines:
    """With one sensor's gain, and its clock late by some seconds."""
    spectra = lines.spectra.copy()
    spectra[channel] *= gain * np.exp(-1j * lines.angular * late)
    return replace(lines, spectra=spectra)


def unrelated_lines(rng: np.random.Generator, *, at_rest: bool) -> Lines:
    """Lines of no superstructure: every residual is large, so that no part of a derivative is hidden."""
    lines = exact_lines(PAPER, rng).every(5)
    spectra = np.array([white_noise(lines.angular.size, rng) for _ in range(DESIGN.layout.channels)])
    return replace(lines, spectra=spectra, noise=np.array([0.1, 0.2, 0.3]), at_rest=at_rest)


def white_noise(count: int, rng: np.random.Generator) -> ComplexVector:
    """(count,) circular complex normal numbers of mean square 1."""
    return np.asarray((rng.standard_normal(count) + 1j * rng.standard_normal(count)) / np.sqrt(2))
