"""Section 7: the paper's simulated building, its ground motion, exact results and every estimator's."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from core.arrays import Matrix, Vector
from core.building import fixed_base_modes
from core.estimators import ESTIMATORS, cms
from core.estimators.result import RestoringForce
from core.estimators.substructure import modal_acceleration
from core.estimators.superstructure import InstrumentedSuperstructure
from core.identification.modes import mass_normalised
from core.model.simulation import Response, simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR, RATE, ground_motion
from service import akt013
from service.formats import FormatError, Gain, Trace, UnknownUnitError, read
from service.reproduction.published import MASS_SCALE, SCATTERED_MASS


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A recorded motion, prepared to replace the paper's."""

    name: str
    acceleration: Vector
    """(n,) m/s² at core.paper.RATE."""


def default_ground() -> Ground:
    """AKT013, which comes with ObsPy."""
    return Ground(akt013.NAME, ground_motion(*akt013.recorded()))


def ground_of_file(path: Path, channel: str | None) -> Ground:
    """The motion that a file holds; its unit does not matter, since its peak becomes the paper's.

    Args:
        path: any format that records may have.
        channel: which of its channels; None where it holds one only.

    Raises:
        FormatError: a file that cannot be read, or that leaves open which channel is meant.
        RecordError: a motion that is too long, or none.
        OSError: a file that cannot be opened.
    """
    trace = _chosen(path.name, _accelerations(path.name, path.read_bytes()), channel)
    return Ground(f"{path.name}, {trace.channel}", ground_motion(trace.to_si(), trace.rate))


def _accelerations(name: str, data: bytes) -> tuple[Trace, ...]:
    """Contents of a file; numbers without a known unit count as accelerations."""
    try:
        traces = read(name, data, {}).traces
    except UnknownUnitError as error:
        traces = read(name, data, dict.fromkeys(error.channels, Gain(1.0, "acceleration"))).traces
    return tuple(trace for trace in traces if trace.quantity == "acceleration")


def _chosen(name: str, traces: tuple[Trace, ...], channel: str | None) -> Trace:
    matching = [trace for trace in traces if channel in (None, trace.channel)]
    if len(matching) == 1:
        return matching[0]
    names = ", ".join(sorted({trace.channel for trace in traces})) or "no acceleration"
    wanted = "one unbroken channel" if channel is None else f"{channel} in one piece"
    raise FormatError(f"{name} holds {names}; {wanted} is needed, name it with --channel")


MODES = 2
"""Modes that the paper shows, at most."""


def identified_shapes(superstructure: InstrumentedSuperstructure, force: RestoringForce) -> Matrix:
    """(floors, MODES or fewer) kg^(-1/2), expanded and mass-normalised."""
    shapes = cms.shape_matrix(force.modes[:MODES], superstructure.floor_mass.size)
    return mass_normalised(shapes, superstructure.floor_mass)


def modal_accelerations(superstructure: InstrumentedSuperstructure, shapes: Matrix) -> Matrix:
    """(modes, n) m/s² kg^(1/2), of the motion relative to the base slab (eq 23)."""
    relative = superstructure.floor_acceleration - superstructure.base_acceleration
    return modal_acceleration(shapes, superstructure.measured, relative)


ROOF = BUILDING.floor_mass.size - 1
MEASURED = np.array([FOURTH_STOREY, ROOF])
LEVELS = ("1F", "2F", "3F", "4F", "5F", "6F", "7F", "RF")
"""Levels of the paper's building, the base slab first."""
LOW, HIGH = 0.01, 0.10
"""Standard deviation of the noise, of each channel's RMS."""
KG_PER_T = 1e3

Forces = Mapping[str, RestoringForce]
"""By the estimator's name."""


@dataclass(frozen=True, slots=True, eq=False)
class NoisyCase:
    """A noisy record and its forces."""

    record: InstrumentedSuperstructure
    forces: Forces
    shapes: Matrix
    """(floors, MODES or fewer) kg^(-1/2), of the modes that CMS identified, expanded and mass-normalised."""
    modal: Matrix
    """(MODES or fewer, n) m/s² kg^(1/2), accelerations of these modes (eq 23)."""


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """Section 7."""

    ground: Ground
    seed: int
    """Seed of the noise: one draw, scaled to each level."""
    response: Response
    shapes: Matrix
    """(floors, modes) kg^(-1/2), analytic."""
    modal: Matrix
    """(modes, n) m/s² kg^(1/2), exact."""
    cases: Mapping[float, NoisyCase]
    """By noise, LOW and HIGH, on all channels."""
    quiet_base: Forces
    """Noise HIGH on the fourth storey and the roof only."""
    by_modes: Mapping[int, Vector]
    """(n,) N at noise LOW from the first one, two, three modes that CMS identified; fewer where it found fewer."""
    light: Forces
    """Noise LOW, all masses assumed MASS_SCALE times their own."""
    scattered: Forces
    """Noise LOW, the masses assumed as in Figure 16."""

    @property
    def time(self) -> Vector:
        """(n,) s."""
        return np.arange(self.response.force.size) / RATE


def simulated(ground: Ground, seed: int, report_step: Callable[[str], None]) -> Simulated:
    """Section 7 under a ground motion.

    Args:
        ground: the motion.
        seed: of the noise.
        report_step: called with the next step.

    Raises:
        CoreError: the motion cannot be used.
    """
    report_step("simulating the paper's building")
    response = simulate(BUILDING, ISOLATOR, ground.acceleration, RATE)
    shapes = fixed_base_modes(BUILDING).shape
    draw = np.random.default_rng(seed).standard_normal((1 + MEASURED.size, response.force.size))
    cases = {}
    for noise in (LOW, HIGH):
        report_step(f"estimating the force with {noise:.0%} noise")
        cases[noise] = _case(_measured(response, noise * draw))
    report_step("estimating the force with noise above the base slab only")
    quiet_base = _forces(_measured(response, HIGH * draw * np.array([[0.0], [1.0], [1.0]])))
    low = cases[LOW]
    report_step("estimating the force with other masses")
    return Simulated(
        ground=ground,
        seed=seed,
        response=response,
        shapes=shapes,
        modal=np.asarray(np.linalg.solve(shapes, response.floor_acceleration - response.base_acceleration)),
        cases=cases,
        quiet_base=quiet_base,
        by_modes=_by_modes(low),
        light=_forces(
            replace(low.record, base_mass=MASS_SCALE * BUILDING.base_mass, floor_mass=MASS_SCALE * BUILDING.floor_mass)
        ),
        scattered=_forces(_with_masses(low.record, KG_PER_T * np.array(SCATTERED_MASS))),
    )


def scattered_total() -> float:
    """Total mass of Figure 16 over the building's."""
    return KG_PER_T * sum(SCATTERED_MASS) / BUILDING.total_mass


def _measured(response: Response, relative_noise: Matrix) -> InstrumentedSuperstructure:
    """Records of the sensors; (1 + measured, n) noise is in fractions of each channel's RMS."""
    exact = np.vstack([response.base_acceleration, response.floor_acceleration[MEASURED]])
    noisy = exact + relative_noise * np.sqrt(np.mean(exact**2, axis=1, keepdims=True))
    return InstrumentedSuperstructure(RATE, noisy[0], noisy[1:], MEASURED, BUILDING.base_mass, BUILDING.floor_mass)


def _case(record: InstrumentedSuperstructure) -> NoisyCase:
    forces = _forces(record)
    shapes = identified_shapes(record, forces[cms.NAME])
    return NoisyCase(record, forces, shapes, modal_accelerations(record, shapes))


def _forces(record: InstrumentedSuperstructure) -> Forces:
    return {name: estimate(record) for name, estimate in ESTIMATORS.items()}


def _by_modes(case: NoisyCase) -> Mapping[int, Vector]:
    modes = case.forces[cms.NAME].modes
    floors = case.record.floor_mass.size
    return {
        count: cms.force_of_shapes(case.record, cms.shape_matrix(modes[:count], floors), modes[:count]).force
        for count in range(1, 4)
        if count <= len(modes)
    }


def _with_masses(record: InstrumentedSuperstructure, from_the_roof: Vector) -> InstrumentedSuperstructure:
    return replace(record, base_mass=float(from_the_roof[-1]), floor_mass=from_the_roof[-2::-1].copy())
