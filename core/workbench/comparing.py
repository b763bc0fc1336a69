"""Comparison of a model with earthquakes: its errors, and where it fails."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from core.comparison.block_corrections import BlockCorrection, block_corrections
from core.comparison.compared import ForceComparison
from core.comparison.failure import Failure, failure, failure_sentences
from core.comparison.misfit import Misfit
from core.comparison.prediction import Prediction, predicted_accelerations, predicted_displacement
from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.rounding import plain
from core.tables import Table, report
from core.units import percent
from core.workbench.earthquakes import Earthquakes, ModelErrors, model_errors
from core.workbench.progress import Progress, silent

SEED = 1
"""Seed of the intervals: the same records give the same report."""
KN, MM, GAL = ("kN", 1e-3), ("mm", 1e3), ("gal", 1e2)
"""Units that engineers read, and their number per SI unit."""


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonResult:
    """A model beside the measurements."""

    model: Isolator
    earthquakes: Earthquakes
    errors: ModelErrors
    failure: Failure
    text: tuple[str, ...]
    """Sentences on where the model fails."""
    corrections: tuple[BlockCorrection, ...]
    """Corrections of stiffness and yield force by each block of the records."""

    def __str__(self) -> str:
        tables = (force_table(self), prediction_table(self, outer_levels(self)))
        title = f"Comparison of {', '.join(self.model.effects)} with {counted(self.earthquakes)}"
        return report(title, *tables, self.text, self.errors.remarks)


def compare(
    model: Isolator, earthquakes: Earthquakes | Sequence[Observation], *, progress: Progress = silent
) -> ComparisonResult:
    """Compare a model's force and response with the measurements of earthquakes.

    Args:
        model: of the isolation layer.
        earthquakes: observations of one building.
        progress: called with each step.

    Raises:
        RecordError: no observation.
        ModelError: the model's force grew beyond all bounds.
    """
    seen = Earthquakes.of(earthquakes)
    progress("driving the model by the measured motion and by the ground alone", 0, 2)
    errors = model_errors(model, seen)
    progress("locating the model's errors", 1, 2)
    failing = failure_of(errors)
    corrections = block_corrections(model, errors.forces)
    progress("compared", 2, 2)
    return ComparisonResult(model, seen, errors, failing, failure_sentences(failing), corrections)


def failure_of(errors: ModelErrors) -> Failure:
    """Places where a model fails, with intervals drawn by the same seed each time.

    Raises:
        RecordError: there is nothing to compare.
    """
    return failure(errors.forces, np.random.default_rng(SEED))


def counted(earthquakes: Earthquakes) -> str:
    """Number of earthquakes in words, the held-out ones beside it."""
    count, out = (len({one.name for one in seen}) for seen in (earthquakes.observations, earthquakes.tested))
    return f"{count} earthquake{'s' if count > 1 else ''}" + (f", {out} held out" if out else "")


def force_table(result: ComparisonResult) -> Table:
    """Errors of the force for the measured motion, against the estimated force."""
    return Table(
        "Force, driven by the measured motion",
        ("earthquake", "peak", "error", "of the force", "fitting rate", "noise ratio"),
        tuple(_force_rows(result)),
        "Peak: of the displacement. Error: root mean square, against the force estimated from the accelerations. "
        "Fitting rate: 100 (1 − ‖error‖ / ‖measured − its mean‖). Noise ratio: error over the error that the "
        "measurement's noise alone makes; over all earthquakes, each by its own noise.",
        sums=1 if len(result.errors.forces) > 1 else 0,
    )


def prediction_table(result: ComparisonResult, levels: Collection[str]) -> Table | None:
    """Errors of the response to the ground motion alone; None if it could be predicted in no earthquake.

    Args:
        result: the comparison.
        levels: levels whose accelerations are shown.
    """
    if not result.errors.predictions:
        return None
    return Table(
        "Predicted from the ground motion alone",
        ("earthquake", "displacement", *(f"acceleration, {level}" for level in levels)),
        tuple(_prediction_rows(result, levels)),
        "Error, root mean square, and in percent of what was measured.",
        sums=1 if len(result.errors.predictions) > 1 else 0,
    )


def levels_of(result: ComparisonResult) -> tuple[str, ...]:
    """Levels whose acceleration was measured in any earthquake, from the base slab upwards."""
    return tuple(predicted_accelerations(result.errors.predictions))


def outer_levels(result: ComparisonResult) -> tuple[str, ...]:
    """The lowest and the highest of them."""
    levels = levels_of(result)
    return tuple(dict.fromkeys([*levels[:1], *levels[-1:]]))


def _force_rows(result: ComparisonResult) -> Iterator[tuple[str, ...]]:
    forces = result.errors.forces
    for one in forces:
        yield _force_row(_label(one, result), _largest([one]), one.misfit, one.misfit.noise_ratio)
    if len(forces) > 1:
        yield _force_row("all", _largest(forces), result.failure.misfit, result.failure.noise_ratio.value)


def _force_row(name: str, largest: float, misfit: Misfit, noise_ratio: float) -> tuple[str, ...]:
    size = (_in(largest, MM), _in(misfit.rms, KN), percent(misfit.nrmse))
    return (name, *size, f"{misfit.fitting_rate:.1f} %", f"{noise_ratio:.3g}")


def _prediction_rows(result: ComparisonResult, levels: Collection[str]) -> Iterator[tuple[str, ...]]:
    predictions = result.errors.predictions
    for one in predictions:
        errors = {level: of.misfit for level, of in one.accelerations.items()}
        yield _prediction_row(_label(one, result), one.displacement.misfit, errors, levels)
    if len(predictions) > 1:
        over_all = predicted_accelerations(predictions)
        yield _prediction_row("all", predicted_displacement(predictions), over_all, levels)


def _prediction_row(
    name: str, displacement: Misfit, accelerations: dict[str, Misfit], levels: Collection[str]
) -> tuple[str, ...]:
    return (
        name,
        _error(displacement, MM),
        *(_error(accelerations[level], GAL) if level in accelerations else "not measured" for level in levels),
    )


def _label(one: ForceComparison | Prediction, result: ComparisonResult) -> str:
    return result.earthquakes.label(one.observation.name, one.observation.direction)


def _largest(forces: Sequence[ForceComparison]) -> float:
    return max(float(np.abs(one.observation.layer.displacement).max()) for one in forces)


def _error(misfit: Misfit, unit: tuple[str, float]) -> str:
    return f"{_in(misfit.rms, unit)}, {percent(misfit.nrmse)}"


def _in(value: float, unit: tuple[str, float]) -> str:
    return f"{plain(value * unit[1], 3)} {unit[0]}"
