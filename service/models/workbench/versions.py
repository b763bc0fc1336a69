"""How large is the error of versions of a model beside each other, on earthquakes fitted and left out?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

from core.comparison.compared import ForceComparison, force_misfit
from core.comparison.misfit import Misfit, together
from core.comparison.prediction import Prediction, predicted_displacement
from core.diagnosis.missing_effects import LOWERS
from service.models.workbench.answers import Answers
from service.models.workbench.errors_table import ErrorsTable
from service.models.workbench.labels import label
from service.models.workbench.records import Records
from service.models.workbench.values import percent

FITTED, LEFT_OUT = "all fitted", "all left out"
HELPS = 0.98
"""Of the error before: what it must fall below on earthquakes left out for a change to help there."""


@dataclass(frozen=True, slots=True, eq=False)
class Version:
    """One of them."""

    name: str
    """What was done to the model, in a few words."""
    answers: Answers

    def error(self, names: Sequence[str]) -> Misfit:
        """N, of the force in the earthquakes of these names."""
        return force_misfit(self.answers.of(names).forces)


def groups(records: Records) -> dict[str, tuple[str, ...]]:
    """Names of the earthquakes that were fitted and of those left out, where there are any."""
    names = tuple(dict.fromkeys(one.name for one in records.observations))
    parted = {
        FITTED: tuple(name for name in names if name not in records.left_out),
        LEFT_OUT: tuple(name for name in names if name in records.left_out),
    }
    return {group: members for group, members in parted.items() if members}


def tables(versions: Sequence[Version], records: Records) -> tuple[ErrorsTable, ...]:
    """Force, and displacement and floors as predicted from the ground alone."""
    force = ErrorsTable(
        "Error of the force, driven by the measured motion",
        ("earthquake", *(version.name for version in versions)),
        _rows(versions, records, _force),
        "Root mean square, in percent of the force and, in brackets, in multiples of the noise floor.",
        sums=_sums(records),
    )
    if not any(version.answers.predictions for version in versions):
        return (force,)
    predicted = ErrorsTable(
        "Error of the response predicted from the ground motion alone",
        ("earthquake", *(version.name for version in versions)),
        _rows(versions, records, _response),
        "Root mean square, in percent of what was measured: displacement of the layer / acceleration of the floors.",
        sums=_sums(records),
    )
    return force, predicted


def gain(before: Version, after: Version, records: Records) -> tuple[str, ...]:
    """What became of the error, in words; that it helps only where it was fitted, if so."""
    parted = groups(records)
    errors = {group: (before.error(names).nrmse, after.error(names).nrmse) for group, names in parted.items()}
    told = [_told(group, *errors[group]) for group in errors]
    said = f"The error of the force goes {' and '.join(told)}."
    if LEFT_OUT not in errors:
        return said, "No earthquake was left out: whether it holds for another one is open; leaving one out tells."
    if helps(before, after, records):
        return (said,)
    return said, "It helps only the earthquakes it was fitted to: do not trust it elsewhere."


def lowers(before: Version, after: Version, records: Records) -> bool:
    """Whether the force's error falls, by an amount that matters, on the earthquakes fitted or on those left out."""
    return any(after.error(names).rms < LOWERS * before.error(names).rms for names in groups(records).values())


def helps(before: Version, after: Version, records: Records) -> bool:
    """Whether the force's error falls on earthquakes left out; where there are none, that is not known to be wrong."""
    names = groups(records).get(LEFT_OUT, ())
    return not names or after.error(names).rms < HELPS * before.error(names).rms


def _told(group: str, was: float, now: float) -> str:
    where = "where it was fitted" if group == FITTED else "on earthquakes left out"
    return f"from {percent(was)} to {percent(now)} {where}"


def _rows(versions: Sequence[Version], records: Records, cell: Callable[[Answers], str]) -> tuple[tuple[str, ...], ...]:
    parted = groups(records)
    seen = dict.fromkeys((one.name, one.direction) for one in records.observations)
    directions = {direction for _, direction in seen}
    each = tuple(
        (
            f"{label(name, direction, directions)}{' (left out)' if name in records.left_out else ''}",
            *(cell(version.answers.of([name]).along(direction)) for version in versions),
        )
        for group in parted.values()
        for name, direction in seen
        if name in group
    )
    sums = parted.items() if _sums(records) else ()
    return (
        *each,
        *((group, *(cell(version.answers.of(names)) for version in versions)) for group, names in sums),
    )


def _sums(records: Records) -> int:
    parted = groups(records)
    return len(parted) if len(records.observations) > 1 else 0


def _force(answered: Answers) -> str:
    return f"{percent(force_misfit(answered.forces).nrmse)} ({floors(answered.forces):.3g})"


def floors(forces: Sequence[ForceComparison]) -> float:
    """Error of forces in multiples of the noise floor, each earthquake in its own."""
    samples = sum(one.misfit.samples for one in forces)
    return sqrt(sum(one.misfit.samples * one.misfit.floors**2 for one in forces) / samples)


def _response(answered: Answers) -> str:
    if not answered.predictions:
        return "not predicted"
    return f"{percent(predicted_displacement(answered.predictions).nrmse)} / {_floors_of(answered.predictions)}"


def _floors_of(predictions: Sequence[Prediction]) -> str:
    each = [of.misfit for one in predictions for of in one.accelerations.values()]
    return percent(together(each).nrmse) if each else "none"
