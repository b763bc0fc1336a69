"""Tables of a model's errors and of its values, as engineers read them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

from core.comparison.compared import force_misfit
from core.comparison.misfit import pooled
from core.comparison.prediction import predicted_displacement
from core.effects import EFFECTS
from core.model.isolator import Isolator
from core.rounding import apart, plain
from core.tables import Table
from core.units import percent, shown, unit
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes, ModelErrors, Version, helps

Deviations = Mapping[str, Mapping[str, float]]
"""Standard deviations by effect and parameter, of those that were fitted; infinite where the records leave it open."""


@dataclass(frozen=True, slots=True)
class Value:
    """One parameter of a model."""

    effect: str
    parameter: str
    value: str
    std: str
    """Empty if the parameter was not fitted."""
    unit: str
    meaning: str


def values_of(model: Isolator, deviations: Deviations) -> Iterator[Value]:
    """Values of all parameters, effect by effect, each to the digit that its standard deviation supports."""
    for name, values in model.effects.items():
        known = deviations.get(name, {})
        for one in EFFECTS[name].parameters:
            value, std = shown(values[one.name], one.unit), known.get(one.name)
            number, spread = _written(value, None if std is None else shown(std, one.unit))
            yield Value(name, one.name, number, spread, unit(one.unit), one.meaning)


def values_table(model: Isolator, deviations: Deviations) -> Table:
    """The same as a table of text."""
    rows = tuple(
        (one.effect, one.parameter, one.value, *([one.std or "fixed"] if deviations else []), one.unit, one.meaning)
        for one in values_of(model, deviations)
    )
    std = ["standard deviation"] if deviations else []
    headings = ("effect", "parameter", "value", *std, "unit", "meaning")
    return Table("Values", headings, rows, texts=("parameter", *std, "unit", "meaning"))


def _written(value: float, std: float | None) -> tuple[str, str]:
    if std is None:
        return plain(value), ""
    if not isfinite(std):
        return plain(value), "not determined"
    if std == 0:
        return plain(value), "0"
    number, spread = apart(value, std)
    return number, f"± {spread}"


def version_tables(versions: Sequence[Version], earthquakes: Earthquakes) -> tuple[Table, ...]:
    """Errors of versions beside each other: of the force, and of the response predicted from the ground alone."""
    headings, sums = ("earthquake", *(version.name for version in versions)), _sums(earthquakes)
    force = Table(
        "Error of the force, driven by the measured motion",
        headings,
        _rows(versions, earthquakes, _force),
        "Root mean square in percent of the force, with the noise ratio in brackets.",
        sums=sums,
    )
    if not any(version.errors.predictions for version in versions):
        return (force,)
    predicted = Table(
        "Error of the response predicted from the ground motion alone",
        headings,
        _rows(versions, earthquakes, _response),
        "Root mean square in percent of the measured value: displacement of the layer / acceleration of the floors.",
        sums=sums,
    )
    return force, predicted


def gain(before: Version, after: Version, earthquakes: Earthquakes) -> tuple[str, ...]:
    """Sentences on the change of the error, with a warning if only the fitted earthquakes profit."""
    errors = {
        group: (before.error(names).nrmse, after.error(names).nrmse) for group, names in earthquakes.groups.items()
    }
    was, now = map(percent, errors[FITTED])
    opening = f"The error of the force changes from {was} to {now} where it was fitted."
    if HELD_OUT not in errors:
        return opening, "No earthquake was held out, so this result is not validated. Hold one out to validate it."
    was_outside, now_outside = map(percent, errors[HELD_OUT])
    opening = (
        f"The error of the force changes from {was} to {now} where it was fitted and from {was_outside} to "
        f"{now_outside} on held-out earthquakes."
    )
    if helps(before, after, earthquakes):
        return (opening,)
    return opening, "The error falls only for the fitted earthquakes: do not use the model for others."


def _rows(
    versions: Sequence[Version], earthquakes: Earthquakes, cell: Callable[[ModelErrors], str]
) -> tuple[tuple[str, ...], ...]:
    groups = earthquakes.groups
    seen = dict.fromkeys((one.name, one.direction) for one in earthquakes.observations)
    each = tuple(
        (
            f"{earthquakes.label(name, direction)}{' (held out)' if name in earthquakes.held_out else ''}",
            *(cell(version.errors.of([name]).along(direction)) for version in versions),
        )
        for group in groups.values()
        for name, direction in seen
        if name in group
    )
    sums = groups.items() if _sums(earthquakes) else ()
    return (*each, *((group, *(cell(version.errors.of(names)) for version in versions)) for group, names in sums))


def _sums(earthquakes: Earthquakes) -> int:
    return len(earthquakes.groups) if len(earthquakes.observations) > 1 else 0


def _force(errors: ModelErrors) -> str:
    return f"{percent(force_misfit(errors.forces).nrmse)} ({errors.noise_ratio:.3g})"


def _response(errors: ModelErrors) -> str:
    if not errors.predictions:
        return "not predicted"
    floors = [of.misfit for one in errors.predictions for of in one.accelerations.values()]
    of_floors = percent(pooled(floors).nrmse) if floors else "none"
    return f"{percent(predicted_displacement(errors.predictions).nrmse)} / {of_floors}"
