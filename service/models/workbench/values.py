"""The values of a model as an engineer reads them: kN, mm, kN/mm, with their standard deviations."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

from core.effects import EFFECTS
from core.rounding import apart, plain
from service.models.model_file import ModelFile
from service.reports.units import shown, unit


@dataclass(frozen=True, slots=True)
class Value:
    """One parameter."""

    effect: str
    parameter: str
    value: str
    std: str
    """Empty of one that was not fitted."""
    unit: str
    meaning: str


def values_of(model: ModelFile) -> Iterator[Value]:
    """Of every parameter, effect by effect."""
    for name, values in model.isolator.effects.items():
        known = model.standard_deviations.get(name, {})
        for one in EFFECTS[name].parameters:
            value, std = shown(values[one.name], one.unit), known.get(one.name)
            number, spread = _written(value, None if std is None else shown(std, one.unit))
            yield Value(name, one.name, number, spread, unit(one.unit), one.meaning)


def percent(share: float) -> str:
    """To a tenth, where that says anything."""
    return f"{100 * share:.1f} %" if share < 1 else f"{100 * share:.0f} %"


def _written(value: float, std: float | None) -> tuple[str, str]:
    """Both as a table shows them, to the digit that the standard deviation supports."""
    if std is None:
        return plain(value), ""
    if not isfinite(std):
        return plain(value), "not determined"
    if std == 0:
        return plain(value), "0"
    number, spread = apart(value, std)
    return number, f"± {spread}"
