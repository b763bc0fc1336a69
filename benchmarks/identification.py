"""Subspace identification of A and C: time, memory and errors of ours and of the peers, on records of three sizes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.identifiers import IDENTIFIERS, OURS, Identifier
from benchmarks.table import Table
from benchmarks.trial import ROUNDS, Limits, Refusal, Trial, Way, trials
from core.arrays import Matrix
from core.building import ShearBuilding, fixed_base_modes
from core.identification.modes import poles
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR

RATE = 100.0
SHAKING = 0.3
"""m/s², standard deviation of the ground's white acceleration."""
NOISE = 0.01
"""Noise over each channel's standard deviation, on input and outputs."""
NEAR = 0.1
"""Tolerance as a fraction of a mode's frequency: a pole farther away is another mode."""

TALL = ShearBuilding(
    base_mass=8.0e6,
    floor_mass=np.full(15, 1.1e6),
    storey_stiffness=np.linspace(6.0e9, 2.0e9, 15),
    damping_coefficient=0.003,
)
"""Fifteen storeys of much the same weight as the paper's seven."""


@dataclass(frozen=True, slots=True, eq=False)
class Size:
    """Size of the record and the model."""

    building: ShearBuilding
    measured: tuple[int, ...]
    """Floors with a sensor, besides the base slab."""
    samples: int
    block_rows: int
    order: int
    goal: str = ""


FAST_WITH_SEVEN = "3 times as fast as SLICOT, 10 times as pyOMA-2, 15 times as mdof, 200 times as sippy-unipi"
SIZES = (
    Size(BUILDING, tuple(range(7)), 18_000, 30, 14, FAST_WITH_SEVEN),
    Size(BUILDING, (FOURTH_STOREY, 6), 18_000, 40, 14, "as fast as SLICOT"),
    Size(TALL, tuple(range(15)), 60_000, 30, 28, "6 times as fast as SLICOT"),
    Size(BUILDING, (FOURTH_STOREY, 6), 6_000, 40, 14),
)


def tables() -> Iterator[Table]:
    """One for each size."""
    return (table(size, IDENTIFIERS, Limits()) for size in SIZES)


def table(size: Size, identifiers: Mapping[str, Identifier], limits: Limits, rounds: int = ROUNDS) -> Table:
    """All ways on one record."""
    u, y = record(size)
    arguments = (u, y, size.block_rows, size.order)
    ways = [Way(name, way.module, partial(way.identify, *arguments)) for name, way in identifiers.items()]
    found = trials(ways, limits, rounds)
    reference = found[OURS]
    quickest = reference.seconds if isinstance(reference, Trial) else np.nan
    return Table(
        title=f"{size.samples:,} samples x {len(y)} outputs",
        about=f"{size.block_rows} block rows, order {size.order}." + (f" Goal: {size.goal}." if size.goal else ""),
        columns=("method", "ms", f"/ {OURS}", "MB", "f1, %", "ζ1, %", "f2, %", "ζ2, %"),
        rows=tuple(row(name, trial, quickest, size.building) for name, trial in found.items()),
    )


def record(size: Size) -> tuple[Matrix, Matrix]:
    """(1, n) of the base slab and (measured, n) of the floors, each of standard deviation one, with noise."""
    rng = np.random.default_rng(0)
    response = simulate(size.building, ISOLATOR, SHAKING * rng.standard_normal(size.samples), RATE)
    clean = np.vstack([response.base_acceleration, response.floor_acceleration[list(size.measured)]])
    scaled = clean / clean.std(axis=1, keepdims=True)
    noisy = scaled + NOISE * rng.standard_normal(clean.shape)
    return noisy[:1], noisy[1:]


def row(
    name: str, trial: Trial[tuple[Matrix, Matrix]] | Refusal, quickest: float, building: ShearBuilding
) -> tuple[str, ...]:
    """Time of one method, and errors of its first two modes, in percent of the exact values."""
    if isinstance(trial, Refusal):
        return (name, trial.reason, *[""] * 6)
    errors = [f"{100 * error:+.2f}" for error in modal_errors(*trial.result, RATE, building, 2)]
    return (name, f"{1e3 * trial.seconds:.1f}", f"{trial.seconds / quickest:.1f}", f"{trial.megabytes:.0f}", *errors)


def modal_errors(A: Matrix, C: Matrix, rate: float, building: ShearBuilding, modes: int) -> Sequence[float]:
    """Relative errors of frequency and damping ratio, mode after mode; NaN for a mode that was not found."""
    found, exact = poles(A, C, rate), fixed_base_modes(building)
    errors: list[float] = []
    for frequency, ratio in zip(exact.frequency[:modes], exact.damping_ratio[:modes], strict=True):
        off = np.abs(found.frequency / frequency - 1)
        if off.size == 0 or off.min() > NEAR:
            errors += [np.nan, np.nan]
        else:
            nearest = int(np.argmin(off))
            errors += [found.frequency[nearest] / frequency - 1, found.damping_ratio[nearest] / ratio - 1]
    return errors
