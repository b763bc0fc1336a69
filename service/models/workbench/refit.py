"""A model's values fitted to records, and what that does to its error."""

from dataclasses import dataclass, replace
from math import inf, sqrt

from core.fitting.fit import Fit
from core.fitting.weighed_fit import weighed_fit
from core.model.isolator import Isolator
from service.jobs.progress import Tell
from service.models.model_file import ModelFile
from service.models.workbench.answers import answers
from service.models.workbench.records import Records
from service.models.workbench.versions import Version

DIGITS = 6
"""Of a value: no record tells more, and a file of them can be read."""


@dataclass(frozen=True, slots=True, eq=False)
class Refit:
    """What came of it."""

    given: ModelFile
    model: ModelFile
    """With the values that the records ask for."""
    fit: Fit
    inflation: float
    """By how much the variances are wider than the measurement's noise alone would have them."""
    records: Records
    versions: tuple[Version, ...]
    """As given, and fitted."""


def refit(given: ModelFile, parent: str, records: Records, tell: Tell) -> Refit:
    """All effects of a model, fitted to all records but those left out.

    Args:
        given: the model.
        parent: its name, for the one made from it.
        records: of the building.
        tell: for who waits.

    Raises:
        RecordError: no record is left to fit to.
        ModelError: the model's force grew beyond all bounds.
    """
    tell("fitting", 0, 2)
    found = weighed_fit(records.fitted, given.isolator)
    model = model_of(found.fit, found.inflation, given, parent, records)
    tell("driving the model by the motion and by the ground alone", 1, 2)
    versions = (
        Version("as given", answers(given.isolator, records)),
        Version("fitted", answers(model.isolator, records)),
    )
    tell("fitted", 2, 2)
    return Refit(given, model, found.fit, found.inflation, records, versions)


def model_of(fit: Fit, inflation: float, given: ModelFile, parent: str, records: Records) -> ModelFile:
    """The fitted model as a file has it."""
    return replace(
        given,
        isolator=_readable(fit.model),
        reference=records.reference,
        parent=parent,
        assumed=(),
        fitted_to=tuple(dict.fromkeys(one.name for one in records.fitted)),
        standard_deviations=deviations(fit, inflation),
    )


def _readable(isolator: Isolator) -> Isolator:
    return Isolator(
        {
            name: {key: float(f"{value:.{DIGITS}g}") for key, value in values.items()}
            for name, values in isolator.effects.items()
        }
    )


def deviations(fit: Fit, inflation: float) -> dict[str, dict[str, float]]:
    """By effect and parameter; infinite where the records do not determine it."""
    found: dict[str, dict[str, float]] = {}
    for (effect, parameter), std in fit.std.items():
        lost = (effect, parameter) in fit.undetermined
        found.setdefault(effect, {})[parameter] = inf if lost else float(f"{std * sqrt(inflation):.3g}")
    return found
