"""Errors of frequencies, damping ratios and shapes, and the coverage of their standard deviations.

    OMP_NUM_THREADS=1 python -m benchmarks.mode_errors

prints a table. Needs `pip install '.[test]'`.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from time import process_time

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # motions are those of the tests

import ground_motions

from benchmarks.table import Table
from core.arrays import Matrix, Vector
from core.building import fixed_base_modes
from core.identification.identified_modes import Identification, identified_modes
from core.identification.modes import real_shape
from core.identification.refinement import refined
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR, RATE

NOISES = (0.01, 0.03, 0.05, 0.1)
"""Noise over each channel's root mean square, on input and outputs."""
SEEDS = 10
"""Draws of the noise for each motion."""
MOTIONS = (ground_motions.akt013, ground_motions.kobe, ground_motions.chi_chi)
MODES = 5
WITHIN = 0.05
"""Relative distance of frequencies within which a mode is the exact one."""
EXACT = fixed_base_modes(BUILDING)
SHAPE = EXACT.shape[FOURTH_STOREY] / EXACT.shape[-1]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """One mode in one record."""

    number: int
    """From 0."""
    normalised: Vector
    """(3,) errors of frequency, damping ratio and shape at the fourth storey, in standard deviations."""
    frequency: float
    """Relative error."""
    damping: tuple[float, float]
    """Relative errors, as identified and refined."""


@cache
def clean(number: int) -> Matrix:
    """(3, n) m/s² of base slab, fourth storey and roof."""
    truth = simulate(BUILDING, ISOLATOR, MOTIONS[number](), RATE)
    return np.vstack([truth.base_acceleration, truth.floor_acceleration[[FOURTH_STOREY, -1]]])


def found_modes(samples: Matrix) -> tuple[list[Found], float]:
    """The refined modes of a record, and the refinement's processor time in s."""
    before = identified_modes(samples[0], samples[1:], RATE, Identification())
    start = process_time()
    after = refined(before, samples[0], samples[1:], RATE, Identification()).modes
    time = process_time() - start
    found = []
    for old, new in zip(before, after, strict=True):
        i = int(np.argmin(np.abs(EXACT.frequency - new.frequency)))
        f, ratio = new.frequency / EXACT.frequency[i] - 1, new.damping_ratio / EXACT.damping_ratio[i] - 1
        if abs(f) > WITHIN or new.deviation is None or new.shape_covariance is None:
            continue
        stds = (
            new.deviation.frequency / EXACT.frequency[i],
            new.deviation.damping_ratio / EXACT.damping_ratio[i],
            float(np.sqrt(new.shape_covariance[0, 0])),
        )
        errors = (f, ratio, real_shape(new.shape)[0] - SHAPE[i])
        of_old = old.damping_ratio / EXACT.damping_ratio[i] - 1
        found.append(Found(i, np.array(errors) / np.array(stds), f, (of_old, ratio)))
    return found, time


def rows(noise: float) -> Iterator[tuple[str, ...]]:
    """A row for each mode."""
    found, times = [], []
    for number in range(len(MOTIONS)):
        rms = np.sqrt(np.mean(clean(number) ** 2, axis=1, keepdims=True))
        for seed in range(SEEDS):
            rng = np.random.default_rng([number, seed])
            modes, time = found_modes(clean(number) + noise * rms * rng.standard_normal(clean(number).shape))
            found += modes
            times.append(time)
    for number in range(MODES):
        if of_mode := [one for one in found if one.number == number]:
            yield (f"{100 * noise:g} %", str(number + 1), *_figures(of_mode), f"{1e3 * np.median(times):.0f}")


def _figures(found: Sequence[Found]) -> tuple[str, ...]:
    covered = np.mean([np.abs(one.normalised) < 1.96 for one in found], axis=0)
    frequency = np.mean([abs(one.frequency) for one in found])
    before, after = np.mean(np.abs([one.damping for one in found]), axis=0)
    shares = (f"{100 * share:.0f}" for share in covered)
    return (str(len(found)), f"{100 * frequency:.3f}", f"{100 * before:.1f}", f"{100 * after:.1f}", *shares)


def main() -> None:
    """Onto the screen."""
    about = (
        f"The paper's building and sensors, {len(MOTIONS)} recorded motions, {SEEDS} draws of noise for each, on input "
        "and outputs. Errors are means of absolute values in %. Covered: share of intervals of ± 1.96 standard "
        "deviations that contain the true value, in %. The time is the median of the refinement."
    )
    head = (
        "noise",
        "mode",
        "records",
        "f",
        "ζ, subspace",
        "ζ, refined",
        "f covered",
        "ζ covered",
        "shape covered",
        "ms",
    )
    print(Table("Modes", about, head, tuple(row for noise in NOISES for row in rows(noise))).markdown())


if __name__ == "__main__":
    main()
