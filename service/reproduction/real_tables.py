"""Section 8's numbers: the paper's, of its building, beside those of the user's."""

from collections.abc import Iterator

import numpy as np

from core.comparison.fitting_rate import fitting_rate
from service.reproduction import published
from service.reproduction.modal import MODES
from service.reproduction.real import RealBuilding
from service.reproduction.table import Table, by_estimator, ours, with_std

KN, PERCENT = 1e-3, 1e2


def real_tables(found: RealBuilding) -> tuple[Table, ...]:
    """Table IV, and the force."""
    return (_modal_information(found), _forces(found))


def _modal_information(found: RealBuilding) -> Table:
    floor = found.description.floors[found.middle].name
    title = f"Table IV. Identified modal information of the superstructure; shape at {floor}, the roof being 1"
    columns = ("building and event", "by", "mode", "frequency (Hz)", "damping (%)", "shape")
    note = "Two buildings: their numbers are alike in kind only."
    return Table(title, columns, (*_papers_modes(), *_our_modes(found)), numbers_from=2, note=note)


def _papers_modes() -> Iterator[tuple[str, ...]]:
    for mode in range(MODES):
        values = (published.REAL_FREQUENCIES, published.REAL_DAMPING_RATIOS, published.REAL_SHAPES)
        frequency, damping, shape = (column[mode] for column in values)
        yield "Raiosya, 2005-07-23", "paper", str(mode + 1), f"{frequency:.4f}", f"{damping:.2f}", f"{shape:.4f}"


def _our_modes(found: RealBuilding) -> Iterator[tuple[str, ...]]:
    for event in found.events:
        name = f"{found.description.code}, {event.start:%Y-%m-%d %H:%M}"
        for estimator, analysis in event.by_estimator.items():
            for number, mode in enumerate(analysis.restoring_force.modes[:MODES], start=1):
                std = None if mode.damping_ratio_std is None else PERCENT * mode.damping_ratio_std
                yield (
                    name,
                    estimator,
                    str(number),
                    with_std(mode.frequency, mode.frequency_std, 3),
                    with_std(PERCENT * mode.damping_ratio, std, 2),
                    f"{mode.shape[found.middle]:.4f}",
                )


def _forces(found: RealBuilding) -> Table:
    rows = []
    for event in found.events:
        forces = {name: analysis.restoring_force.force for name, analysis in event.by_estimator.items()}
        name = f"{event.start:%Y-%m-%d %H:%M}"
        peaks = {estimator: f"{np.abs(force).max() * KN:.0f}" for estimator, force in forces.items()}
        rows.append((name, "largest force (kN)", *by_estimator(peaks)))
        if event.truth is not None:
            fits = {estimator: f"{fitting_rate(event.truth, force):.1f}" for estimator, force in forces.items()}
            rows.append((name, "fitting rate (%)", *by_estimator(fits)))
    note = (
        "The truth of the fitting rate is F = -Σ m_i a_i over every level, all of which were recorded; "
        f"the estimators were given {', '.join(found.sensors)}."
    )
    known = any(event.truth is not None for event in found.events)
    title = "Figure 22. Restoring force of the isolation layer"
    return Table(title, ("event", "", *ours()), tuple(rows), numbers_from=2, note=note if known else "")
