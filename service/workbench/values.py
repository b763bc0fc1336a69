"""The values of a model as an engineer reads them: kN, mm, kN/mm, with their standard deviations."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

from core.effects import EFFECTS
from service.pages.units import shown, unit
from service.toml_files.model_file import ModelFile

LONG = 1e7
"""From which on a number is written with an exponent."""


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
            told = "" if std is None else _std(shown(std, one.unit))
            yield Value(name, one.name, rounded(value, 4), told, unit(one.unit), one.meaning)


def rounded(value: float, digits: int) -> str:
    """A number without an exponent where that is short."""
    text = f"{float(f'{value:.{digits}g}'):,.10g}" if abs(value) < LONG else f"{value:.{digits}g}"
    return text.replace("-", "−")


def percent(share: float) -> str:
    """To a tenth, where that says anything."""
    return f"{100 * share:.1f} %" if share < 1 else f"{100 * share:.0f} %"


def _std(value: float) -> str:
    return f"± {rounded(value, 2)}" if isfinite(value) else "not determined"
