"""Section 8 in numbers: modes, forces, and Figure 24's stiffness and damping by amplitude, beside the paper's."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
import scipy

from core.arrays import Vector
from core.comparison.misfit import fitting_rate
from core.estimators import ESTIMATORS, cms
from core.isolation_layer.equivalent import EquivalentSegment
from core.tables import Table
from service.reproduction import published
from service.reproduction.cells import NONE, by_estimator, ours, table, with_std
from service.reproduction.real import RealBuilding
from service.reproduction.simulated import MODES

OMITTED = "Figures {} are left out: {}."
MM, KN, KN_PER_MM, PERCENT = 1e3, 1e-3, 1e-6, 1e2

BOUNDS = (0.0, 0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3, 200e-3, np.inf)
"""m, of the amplitudes that are put together."""
SMALL = BOUNDS[1]
"""m, below which an amplitude is small."""
NEAR = 0.25
"""Tolerance as a fraction of a shear strain: cycles within it represent the strain."""

Cycles = Mapping[str, Sequence[EquivalentSegment]]
"""By estimator, of all events."""


def real_tables(building: RealBuilding) -> tuple[Table, ...]:
    """Table IV, and the force."""
    return (_modal_information(building), _forces(building))


def _modal_information(building: RealBuilding) -> Table:
    floor = building.description.floors[building.middle].name
    title = (
        f"Table IV. Identified modal information of the superstructure; shape at level {floor}, relative to the roof"
    )
    columns = ("building and event", "by", "mode", "frequency (Hz)", "damping (%)", "shape")
    note = "These are two different buildings: compare the pattern, not the values."
    return table(title, columns, (*_papers_modes(), *_our_modes(building)), numbers_from=2, note=note)


def _papers_modes() -> Iterator[tuple[str, ...]]:
    for mode in range(MODES):
        values = (published.REAL_FREQUENCIES, published.REAL_DAMPING_RATIOS, published.REAL_SHAPES)
        frequency, damping, shape = (column[mode] for column in values)
        yield "Raiosya, 2005-07-23", "paper", str(mode + 1), f"{frequency:.4f}", f"{damping:.2f}", f"{shape:.4f}"


def _our_modes(building: RealBuilding) -> Iterator[tuple[str, ...]]:
    for event in building.events:
        name = f"{building.description.code}, {event.start:%Y-%m-%d %H:%M}"
        for estimator, analysis in event.by_estimator.items():
            for number, mode in enumerate(analysis.restoring_force.modes[:MODES], start=1):
                std = None if mode.damping_ratio_std is None else PERCENT * mode.damping_ratio_std
                yield (
                    name,
                    estimator,
                    str(number),
                    with_std(mode.frequency, mode.frequency_std, 3),
                    with_std(PERCENT * mode.damping_ratio, std, 2),
                    f"{mode.shape[building.middle]:.4f}",
                )


def _forces(building: RealBuilding) -> Table:
    rows = []
    for event in building.events:
        forces = {name: analysis.restoring_force.force for name, analysis in event.by_estimator.items()}
        name = f"{event.start:%Y-%m-%d %H:%M}"
        peaks = {estimator: f"{np.abs(force).max() * KN:.0f}" for estimator, force in forces.items()}
        rows.append((name, "largest force (kN)", *by_estimator(peaks)))
        if event.truth is not None:
            fits = {estimator: f"{fitting_rate(event.truth, force):.1f}" for estimator, force in forces.items()}
            rows.append((name, "fitting rate (%)", *by_estimator(fits)))
    note = (
        "The fitting rate is relative to F = -Σ m_i a_i over all levels, each of which was recorded. "
        f"The estimators got the records of: {', '.join(building.sensors)}."
    )
    known = any(event.truth is not None for event in building.events)
    title = "Figure 22. Restoring force of the isolation layer"
    return table(title, ("event", "", *ours()), tuple(rows), numbers_from=2, note=note if known else "")


def amplitude_tables(building: RealBuilding) -> tuple[Table, ...]:
    """k_eq and c_eq by amplitude, and what section 8 concludes from them."""
    cycles = {name: _cycles(building, name) for name in ESTIMATORS}
    return (_by_amplitude(cycles), _conclusions(cycles))


def _cycles(building: RealBuilding, estimator: str) -> tuple[EquivalentSegment, ...]:
    analyses = (event.by_estimator.get(estimator) for event in building.events)
    return tuple(cycle for analysis in analyses if analysis is not None for cycle in analysis.equivalent)


def _by_amplitude(cycles: Cycles) -> Table:
    rows = []
    for low, high in pairwise(BOUNDS):
        within = {name: [c for c in every if low <= c.amplitude < high] for name, every in cycles.items()}
        rows += [(_range(low, high), name, *_medians(some)) for name, some in within.items() if some]
    note = "The values are medians over the cycles of all events ± the median of the standard deviations."
    title = "Figure 24. Equivalent stiffness and damping coefficient against amplitude"
    columns = ("amplitude (mm)", "estimator", "cycles", "k_eq (kN/mm)", "c_eq (kN s/mm)")
    return table(title, columns, tuple(rows), numbers_from=2, note=note)


def _range(low: float, high: float) -> str:
    return f"{low * MM:g} to {high * MM:g}" if np.isfinite(high) else f"above {low * MM:g}"


def _medians(cycles: Sequence[EquivalentSegment]) -> tuple[str, str, str]:
    k, k_std, c, c_std = np.median([(s.k_eq, s.k_eq_std, s.c_eq, s.c_eq_std) for s in cycles], axis=0) * KN_PER_MM
    return str(len(cycles)), with_std(float(k), float(k_std), 2), with_std(float(c), float(c_std), 3)


def _conclusions(cycles: Cycles) -> Table:
    some = {name: every for name, every in cycles.items() if every}
    drop = f"fall of k_eq (%), from below {SMALL * MM:g} mm to {100 * published.STRAIN_OF_THE_DROP:g} % shear strain"
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
    note = "The statements of the paper are about another building and a single earthquake."
    return table("What section 8 says about Figure 24", ("", "paper", *ours()), rows, note=note)


def _column(cycles: Sequence[EquivalentSegment], name: str) -> Vector:
    return np.array([getattr(cycle, name) for cycle in cycles], dtype=float)


def _drop(cycles: Sequence[EquivalentSegment]) -> str:
    strain = published.STRAIN_OF_THE_DROP
    small = [c.k_eq for c in cycles if c.amplitude < SMALL]
    there = [c.k_eq for c in cycles if c.shear_strain is not None and abs(c.shear_strain / strain - 1) < NEAR]
    return f"{PERCENT * (1 - np.median(there) / np.median(small)):.0f}" if small and there else NONE


def _rank(values: Vector, amplitude: Vector) -> str:
    return f"{scipy.stats.spearmanr(values, amplitude).statistic:.2f}" if values.size > 2 else NONE


def _spread(values: Vector, std: Vector) -> str:
    return f"{PERCENT * np.median(std / np.abs(values)):.0f}"


def real_remarks(building: RealBuilding) -> tuple[str, ...]:
    """Remarks on section 8."""
    return (
        "The paper's building is Raiosya, whose records are not included in this program. Here, the same steps are "
        f"applied to another building: {building.description.name}, direction {building.direction}, sensors "
        f"{', '.join(building.sensors)}. Compare the pattern, not the values.",
        "The paper cuts the record into segments, but does not say where. Here, a segment is one cycle between zero "
        "up-crossings and is fitted with an intercept, and every value has a standard deviation.",
        *_missing(building),
        *(f"Not used: {reason}" for reason in building.refused),
    )


def _missing(building: RealBuilding) -> Iterator[str]:
    shown = building.strongest.by_estimator[cms.NAME]
    if shown.displacement is None:
        yield OMITTED.format("19, 23 and 24", "no sensor measures the layer's motion")
    if not shown.restoring_force.modes:
        yield OMITTED.format("20 and 21", "no mode was identified")
