"""Our subspace identification beside SLICOT (package `ctrlsys`), in one run: time of A and C, and what both find.

    OMP_NUM_THREADS=1 python benchmarks/identification.py

The superstructure of the paper's building with 1 % of noise on every channel, the base slab driven by white noise, so
that the program needs no recorded motion. SLICOT: IB01AD and IB01BD, MOESP, with its QR and its Cholesky factorisation.
"""

from collections.abc import Callable
from time import process_time

import ctrlsys
import numpy as np

from core.arrays import Matrix
from core.building import fixed_base_modes
from core.modal import poles
from core.paper import BUILDING, ISOLATOR
from core.projection import project
from core.simulation import simulate
from core.subspace import moesp, observability_span

RATE = 100.0
ORDER = 14
REPEATS = 5


def ours(u: Matrix, y: Matrix, block_rows: int) -> tuple[Matrix, Matrix]:
    return observability_span(project(u, y, block_rows), moesp).system(ORDER)


def slicot(algorithm: str) -> Callable[[Matrix, Matrix, int], tuple[Matrix, Matrix]]:
    def identify(u: Matrix, y: Matrix, block_rows: int) -> tuple[Matrix, Matrix]:
        m, p, n = len(u), len(y), u.shape[1]
        columns = np.asfortranarray(u.T), np.asfortranarray(y.T)
        _, r, _, _, info = ctrlsys.ib01ad("M", algorithm, "N", "O", "N", "N", block_rows, m, p, *columns, 0.0, -1.0)
        if info:
            raise RuntimeError(f"IB01AD ended with {info}")
        A, C, *_, info = ctrlsys.ib01bd("M", "C", "N", block_rows, ORDER, m, p, n, r, 0.0)
        if info:
            raise RuntimeError(f"IB01BD ended with {info}")
        return A, C

    return identify


def record(floors: list[int]) -> tuple[Matrix, Matrix]:
    rng = np.random.default_rng(0)
    truth = simulate(BUILDING, ISOLATOR, 0.3 * rng.standard_normal(18000), RATE)
    clean = np.vstack([truth.base_acceleration, truth.floor_acceleration[floors]])
    scaled = clean / clean.std(axis=1, keepdims=True)
    noisy = scaled + 0.01 * rng.standard_normal(clean.shape)
    return noisy[:1], noisy[1:]


def errors(A: Matrix, C: Matrix) -> str:
    found, exact = poles(A, C, RATE), fixed_base_modes(BUILDING)
    lines = []
    for frequency, ratio in zip(exact.frequency[:2], exact.damping_ratio[:2], strict=True):
        near = int(np.argmin(np.abs(found.frequency - frequency)))
        in_frequency, in_damping = found.frequency[near] / frequency - 1, found.damping_ratio[near] / ratio - 1
        lines.append(f"{100 * in_frequency:+7.3f} {100 * in_damping:+7.2f}")
    return "   ".join(lines)


def main() -> None:
    ways = {"SLICOT, Cholesky": slicot("C"), "SLICOT, QR": slicot("Q"), "core.subspace": ours}
    for floors, block_rows in (([2, 6], 40), (list(range(7)), 30)):
        u, y = record(floors)
        print(
            f"\n18,000 samples x {len(y)} outputs, {block_rows} block rows, order {ORDER}, CPU time, best of {REPEATS}"
        )
        print(f"{'':20}{'ms':>9}  ratio   errors in %: f1, damping 1, f2, damping 2")
        reference = None
        for name, identify in ways.items():
            times = []
            for _ in range(REPEATS):
                start = process_time()
                A, C = identify(u, y, block_rows)
                times.append(process_time() - start)
            reference = reference or min(times)
            print(f"{name:20}{1e3 * min(times):9.1f}{min(times) / reference:7.2f}   {errors(A, C)}")


if __name__ == "__main__":
    main()
