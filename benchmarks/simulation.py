"""Simulation of the paper's building: ours against scipy's LSODA, time and error of both in one run.

python benchmarks/simulation.py
"""

from collections.abc import Callable
from time import process_time

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

from core.arrays import Vector
from core.building import damping_matrix, mass_matrix, stiffness_matrix
from core.paper import BUILDING, ISOLATOR
from core.simulation import simulate

RATE, SECONDS, PEAK = 100.0, 180.0, 0.7013


def ground() -> Vector:
    """(n,) m/s², a burst of waves between 0.2 and 10 Hz, its peak the one of the paper's record."""
    rng = np.random.default_rng(20050723)
    t = np.arange(0.0, SECONDS, 1 / RATE)
    waves = np.zeros(t.size)
    for frequency in np.linspace(0.2, 10.0, 200):
        waves += rng.standard_normal() * np.sin(2 * np.pi * (frequency * t + rng.uniform()))
    burst: Vector = waves * (t / 20.0) * np.exp(1 - t / 20.0)
    return PEAK * burst / abs(burst).max()


def force_by_lsoda(motion: Vector, rtol: float) -> Vector:
    """(n,) N, eq 1 and eq 22 written down again."""
    t = np.arange(motion.size) / RATE
    layer = ISOLATOR.effects
    k_b, c_b, law = layer["elastic"]["k_b"], layer["viscous"]["c_b"], layer["bouc_wen"]
    M = mass_matrix(BUILDING)
    n = len(M)
    to_k = -np.linalg.solve(M, stiffness_matrix(BUILDING, k_b))
    to_c = -np.linalg.solve(M, damping_matrix(BUILDING, c_b))

    def rates(at: float, y: Vector) -> Vector:
        i = min(int(at * RATE), motion.size - 2)
        a_g = motion[i] + (at * RATE - i) * (motion[i + 1] - motion[i])
        v, z = y[n:-1], y[-1]
        acceleration = to_k @ y[:n] + to_c @ v - a_g
        acceleration[-1] -= law["F_y"] * z / M[-1, -1]
        turned = law["gamma"] * np.sign(z * v[-1]) + law["beta"]
        return np.concatenate([v, acceleration, [(law["A"] - turned * abs(z)) * v[-1] / law["D_y"]]])

    y = solve_ivp(rates, (0, t[-1]), np.zeros(2 * n + 1), "LSODA", t, rtol=rtol, atol=1e-3 * rtol).y
    force: Vector = k_b * y[n - 1] + c_b * y[2 * n - 1] + law["F_y"] * y[-1]
    return force


def timed(run: Callable[[], Vector], repeats: int) -> tuple[float, Vector]:
    """Shortest processor time in s, and what the run gave."""
    times = []
    for _ in range(repeats):
        start = process_time()
        result = run()
        times.append(process_time() - start)
    return min(times), result


def main() -> None:
    """Print the table; the error is relative to 200 steps a sample, in the norm."""
    motion = ground()

    def ours(substeps: int | None = None) -> Vector:
        return simulate(BUILDING, ISOLATOR, motion, RATE, substeps=substeps).force

    compiling, _ = timed(ours, 1)
    truth = ours(200)
    rows = [("simulate", *timed(ours, 20))]
    rows += [(f"simulate, {s} steps a sample", *timed(lambda s=s: ours(s), 10)) for s in (1, 2, 4, 8, 16)]  # type: ignore[misc]
    rows += [(f"LSODA, rtol {r:g}", *timed(lambda r=r: force_by_lsoda(motion, r), 1)) for r in (1e-6, 1e-8)]  # type: ignore[misc]
    table = Table("way", "ms", "times simulate", "error of the force", title=f"{motion.size} samples, {SECONDS:g} s")
    for name, seconds, force in rows:
        error = np.linalg.norm(force - truth) / np.linalg.norm(truth)
        table.add_row(name, f"{1e3 * seconds:.1f}", f"{seconds / rows[0][1]:.1f}", f"{error:.1e}")
    console = Console()
    console.print(table)
    console.print(f"first call of a process, compiling: {compiling:.1f} s")


if __name__ == "__main__":
    main()
