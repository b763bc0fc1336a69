"""Figure 24 in numbers: how do equivalent stiffness and damping change with amplitude, and as the paper says?"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from scipy.stats import spearmanr

from core.arrays import Vector
from core.estimators import ESTIMATORS
from core.isolation_layer.equivalent import EquivalentSegment
from service.reproduction import published
from service.reproduction.real import RealBuilding
from service.reproduction.table import NONE, Table, by_estimator, ours, with_std

MM, KN_PER_MM, PERCENT = 1e3, 1e-6, 1e2
BOUNDS = (0.0, 0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3, 200e-3, np.inf)
"""m, of the amplitudes that are put together."""
SMALL = BOUNDS[1]
"""m, below which an amplitude is small."""
NEAR = 0.25
"""Of a shear strain: cycles that are no farther from it stand for it."""

Cycles = Mapping[str, Sequence[EquivalentSegment]]
"""By estimator, of all events."""


def amplitude_tables(found: RealBuilding) -> tuple[Table, ...]:
    """k_eq and c_eq by amplitude, and what section 8 concludes from them."""
    cycles = {name: _cycles(found, name) for name in ESTIMATORS}
    return (_by_amplitude(cycles), _conclusions(cycles))


def _cycles(found: RealBuilding, estimator: str) -> tuple[EquivalentSegment, ...]:
    analyses = (event.by_estimator.get(estimator) for event in found.events)
    return tuple(cycle for analysis in analyses if analysis is not None for cycle in analysis.equivalent)


def _by_amplitude(cycles: Cycles) -> Table:
    rows = []
    for low, high in pairwise(BOUNDS):
        within = {name: [c for c in every if low <= c.amplitude < high] for name, every in cycles.items()}
        rows += [(_range(low, high), name, *_medians(some)) for name, some in within.items() if some]
    note = "Medians over the cycles of all events ± the median of their standard deviations."
    title = "Figure 24. Equivalent stiffness and damping coefficient against amplitude"
    columns = ("amplitude (mm)", "ours by", "cycles", "k_eq (kN/mm)", "c_eq (kN s/mm)")
    return Table(title, columns, tuple(rows), numbers_from=2, note=note)


def _range(low: float, high: float) -> str:
    return f"{low * MM:g} to {high * MM:g}" if np.isfinite(high) else f"above {low * MM:g}"


def _medians(cycles: Sequence[EquivalentSegment]) -> tuple[str, str, str]:
    k, k_std, c, c_std = np.median([(s.k_eq, s.k_eq_std, s.c_eq, s.c_eq_std) for s in cycles], axis=0) * KN_PER_MM
    return str(len(cycles)), with_std(float(k), float(k_std), 2), with_std(float(c), float(c_std), 3)


def _conclusions(cycles: Cycles) -> Table:
    some = {name: every for name, every in cycles.items() if every}
    drop = f"k_eq falls by (%), to {100 * published.STRAIN_OF_THE_DROP:g} % shear strain from below {SMALL * MM:g} mm"
    k_rank, c_rank = (
        {name: _rank(_column(every, quantity), _column(every, "amplitude")) for name, every in some.items()}
        for quantity in ("k_eq", "c_eq")
    )
    k_spread, c_spread = (
        {name: _spread(_column(every, quantity), _column(every, f"{quantity}_std")) for name, every in some.items()}
        for quantity in ("k_eq", "c_eq")
    )
    rows = (
        (drop, f"{published.DROP:.0f}", *by_estimator({name: _drop(every) for name, every in some.items()})),
        ("rank correlation of k_eq with amplitude", "decreases", *by_estimator(k_rank)),
        ("rank correlation of c_eq with amplitude", "decreases", *by_estimator(c_rank)),
        ("standard deviation of k_eq (%), median over cycles", "more stable", *by_estimator(k_spread)),
        ("standard deviation of c_eq (%), median over cycles", "less stable", *by_estimator(c_spread)),
    )
    note = "The paper's words are of another building and of one earthquake."
    return Table("What section 8 says of Figure 24", ("", "paper", *ours()), rows, note=note)


def _column(cycles: Sequence[EquivalentSegment], name: str) -> Vector:
    return np.array([getattr(cycle, name) for cycle in cycles], dtype=float)


def _drop(cycles: Sequence[EquivalentSegment]) -> str:
    strain = published.STRAIN_OF_THE_DROP
    small = [c.k_eq for c in cycles if c.amplitude < SMALL]
    there = [c.k_eq for c in cycles if c.shear_strain is not None and abs(c.shear_strain / strain - 1) < NEAR]
    return f"{PERCENT * (1 - np.median(there) / np.median(small)):.0f}" if small and there else NONE


def _rank(values: Vector, amplitude: Vector) -> str:
    return f"{spearmanr(values, amplitude).statistic:.2f}" if values.size > 2 else NONE


def _spread(values: Vector, std: Vector) -> str:
    return f"{PERCENT * np.median(std / np.abs(values)):.0f}"
