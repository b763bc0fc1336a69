"""The errors of a model, earthquake by earthquake and over all, as an engineer reads them: mm, kN, gal, %."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from core.comparison.compared import ForceComparison
from core.comparison.misfit import Misfit
from core.comparison.prediction import Prediction, predicted_accelerations, predicted_displacement
from core.rounding import plain
from service.models.workbench.held import Held
from service.models.workbench.labels import label
from service.models.workbench.values import percent

KN, MM, GAL = ("kN", 1e-3), ("mm", 1e3), ("gal", 1e2)
"""What users read, per SI unit."""


@dataclass(frozen=True, slots=True)
class ErrorsTable:
    """Text for a terminal or a page; the first column names, the others are numbers unless told."""

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str
    sums: int
    """Rows at the end that are over several earthquakes."""
    texts: tuple[str, ...] = ()
    """Headings of columns that are no numbers, besides the first."""


def force_errors(found: Held) -> ErrorsTable:
    """Driven by the measured motion, against the estimated force."""
    return ErrorsTable(
        "Force, driven by the measured motion",
        ("earthquake", "peak", "error", "of the force", "fitting rate", "noise floors"),
        tuple(_force_rows(found)),
        "Peak: of the displacement. Error: root mean square, against the force estimated from the accelerations. "
        "Fitting rate: 100 (1 − ‖error‖ / ‖measured − its mean‖). Noise floors: error over what the measurement's "
        "noise alone would make of it; in all, each earthquake in its own.",
        sums=1 if len(found.answers.forces) > 1 else 0,
    )


def predicted_errors(found: Held, levels: Collection[str]) -> ErrorsTable | None:
    """Driven by the ground alone, against what was measured; None if that was possible in no earthquake.

    Args:
        found: the comparison.
        levels: whose accelerations are told.
    """
    if not found.answers.predictions:
        return None
    return ErrorsTable(
        "Predicted from the ground motion alone",
        ("earthquake", "displacement", *(f"acceleration, {level}" for level in levels)),
        tuple(_predicted_rows(found, levels)),
        "Error, root mean square, and in percent of what was measured.",
        sums=1 if len(found.answers.predictions) > 1 else 0,
    )


def levels_of(found: Held) -> tuple[str, ...]:
    """Whose acceleration was measured in any earthquake, from the base slab upwards."""
    return tuple(predicted_accelerations(found.answers.predictions))


def _force_rows(found: Held) -> Iterator[tuple[str, ...]]:
    for one in found.answers.forces:
        yield _force_row(_name(one, found), _largest([one]), one.misfit, one.misfit.floors)
    if len(found.answers.forces) > 1:
        failure = found.failure
        yield _force_row("all", _largest(found.answers.forces), failure.misfit, failure.floors.value)


def _force_row(name: str, largest: float, misfit: Misfit, floors: float) -> tuple[str, ...]:
    size = (_in(largest, MM), _in(misfit.rms, KN), percent(misfit.nrmse))
    return (name, *size, f"{misfit.fitting_rate:.1f} %", f"{floors:.3g}")


def _predicted_rows(found: Held, levels: Collection[str]) -> Iterator[tuple[str, ...]]:
    for one in found.answers.predictions:
        errors = {level: of.misfit for level, of in one.accelerations.items()}
        yield _predicted_row(_name(one, found), one.displacement.misfit, errors, levels)
    if len(found.answers.predictions) > 1:
        over_all = predicted_accelerations(found.answers.predictions)
        yield _predicted_row("all", predicted_displacement(found.answers.predictions), over_all, levels)


def _predicted_row(
    name: str, displacement: Misfit, accelerations: dict[str, Misfit], levels: Collection[str]
) -> tuple[str, ...]:
    return (
        name,
        _error(displacement, MM),
        *(_error(accelerations[level], GAL) if level in accelerations else "not measured" for level in levels),
    )


def _name(one: ForceComparison | Prediction, found: Held) -> str:
    of = one.observation
    return label(of.name, of.direction, found.model.directions)


def _largest(forces: Sequence[ForceComparison]) -> float:
    return max(float(np.abs(one.observation.layer.displacement).max()) for one in forces)


def _error(misfit: Misfit, unit: tuple[str, float]) -> str:
    return f"{_in(misfit.rms, unit)}, {percent(misfit.nrmse)}"


def _in(value: float, unit: tuple[str, float]) -> str:
    return f"{plain(value * unit[1], 3)} {unit[0]}"
