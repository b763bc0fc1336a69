"""Model files: TOML in; a model of the isolation layer, or all faults of the file, out."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from decimal import Decimal
from math import isfinite
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from core.effect import Parameter
from core.effects import EFFECTS
from core.errors import ModelError
from core.isolation_layer.motion import Integral
from core.model.isolator import Isolator
from core.record import Direction
from service.formats.toml_problems import Problem, Table, TomlError, checked, unknown, wrong_keys

Deviations = Mapping[str, Mapping[str, float]]
BARE = re.compile(r"[A-Za-z0-9_-]+")
"""A key that needs no quotes."""
Directions = Literal["x", "y", "xy"]


def _aware(moment: datetime) -> datetime:
    if moment.tzinfo is None:
        raise ValueError("it has no offset from UTC; write it as 2024-03-05T06:07:08Z")
    return moment.astimezone(UTC)


Values = dict[str, dict[str, float]]
WrittenDeviations = dict[str, dict[str, Annotated[float, Field(ge=0, allow_inf_nan=True)]]]
Text = Annotated[str, Field(min_length=1)]


class ModelTable(Table):
    """The top of the file: the model."""

    building: Text = Field(description="code of the building whose isolation layer it is of")
    direction: Directions = Field(
        description="x or y: of the one horizontal direction; xy: the same values hold in both, and an effect that "
        "couples the directions sees each from the other"
    )
    reference: Annotated[datetime, AfterValidator(_aware)] | None = Field(
        default=None,
        description="date and time with offset, from which effects count time; default: the start of the first record",
    )
    parent: Text | None = Field(default=None, description="the model that this one was made from, by its file's name")
    assumed: list[Text] = Field(
        default=[], description="parameters that were neither given nor measured: start values for a fit"
    )
    fitted_to: list[Text] = Field(
        default=[], description="earthquakes that the values were fitted to, by the start of their records"
    )
    integral: Integral | None = Field(
        default=None,
        description="motion that it was fitted to, from a displacement channel that was integrated from accelerations: "
        "recorded or restored; default: as the setting `analysis.integral` says",
    )
    effects: Values = Field(
        description="a table for each effect, with the value of every one of its parameters, SI; those that choose the "
        "form of its law may be left out"
    )
    standard_deviations: WrittenDeviations = Field(
        default={}, description="the same for their standard deviations; inf where the records did not determine it"
    )


class ModelFileError(TomlError):
    """All that is wrong with a model file, one problem a line, each with its line and key."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """A model, and where it comes from."""

    building: str
    """Code."""
    direction: Directions
    isolator: Isolator
    reference: datetime | None = None
    """From which effects count time, aware; None: the start of the first record."""
    parent: str | None = None
    assumed: tuple[str, ...] = ()
    """Parameters that were neither given nor measured."""
    fitted_to: tuple[str, ...] = ()
    """Earthquakes."""
    integral: Integral | None = None
    """Motion that it was fitted to, from a displacement channel that was integrated from accelerations; None: as the
    settings say."""
    standard_deviations: Deviations = field(default_factory=dict)
    """By effect and parameter, of those that were fitted; infinite where the records did not determine it."""

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Directions that the model holds in."""
        return ("x", "y") if self.direction == "xy" else (self.direction,)


def read(text: str) -> ModelFile:
    """The model that a file describes.

    Raises:
        ModelFileError: with every problem of the file, not only the first.
    """
    try:
        table = ModelTable.model_validate(checked(text, (_wrong_keys, _wrong_effects, _wrong_deviations)))
        isolator = Isolator(table.effects)
    except TomlError as error:
        raise ModelFileError(error.problems) from None
    except ModelError as error:  # effects that do not go together
        raise ModelFileError((str(error),)) from None
    return ModelFile(
        building=table.building,
        direction=table.direction,
        isolator=isolator,
        reference=table.reference,
        parent=table.parent,
        assumed=tuple(table.assumed),
        fitted_to=tuple(table.fitted_to),
        integral=table.integral,
        standard_deviations=table.standard_deviations,
    )


def written(model: ModelFile) -> str:
    """The file, so that `read` gives the model back."""
    return "\n".join([*_opening(model), *_effects(model.isolator), *_standard_deviations(model), ""])


def _opening(model: ModelFile) -> Iterator[str]:
    yield f"building = {_text(model.building)}"
    yield f"direction = {_text(model.direction)}"
    if model.reference is not None:
        yield f"reference = {model.reference.astimezone(UTC).isoformat().replace('+00:00', 'Z')}"
    if model.parent is not None:
        yield f"parent = {_text(model.parent)}"
    if model.assumed:
        yield f"assumed = {_texts(model.assumed)}  # to be fitted to records"
    if model.fitted_to:
        yield f"fitted_to = {_texts(model.fitted_to)}"
    if model.integral is not None:
        yield f"integral = {_text(model.integral)}"


def _effects(isolator: Isolator) -> Iterator[str]:
    if not isolator.effects:
        yield "\n[effects]"
    for name, values in isolator.effects.items():
        yield f"\n[effects.{_key(name)}]  # {EFFECTS[name].title}"
        for parameter in EFFECTS[name].parameters:
            yield f"{_key(parameter.name)} = {_number(values[parameter.name])}  # {_meaning(parameter)}"


def _standard_deviations(model: ModelFile) -> Iterator[str]:
    for name, values in model.standard_deviations.items():
        yield f"\n[standard_deviations.{_key(name)}]"
        yield from (f"{_key(parameter)} = {_number(value)}" for parameter, value in values.items())


def _meaning(parameter: Parameter) -> str:
    return f"{'no unit' if parameter.unit == '1' else parameter.unit}, {parameter.meaning}"


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", r"\u007f")  # which JSON leaves and TOML does not


def _texts(texts: tuple[str, ...]) -> str:
    return f"[{', '.join(_text(text) for text in texts)}]"


def _key(name: str) -> str:
    return name if BARE.fullmatch(name) else _text(name)


def _number(value: float) -> str:
    """The shortest that is read as the same, with exponents of 3, 6, ... as engineers write."""
    if not isfinite(value):
        return str(value)
    short = Decimal(repr(value)).normalize().to_eng_string().replace("E+", "e").replace("E", "e")
    return short if "." in short or "e" in short else f"{short}.0"


def _wrong_keys(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Keys that are unknown, missing or of a wrong kind, except those in the tables of effects."""
    tables = {"effects", "standard_deviations"}
    yield from wrong_keys(
        {key: {} if key in tables and isinstance(value, dict) else value for key, value in document.items()}, ModelTable
    )


def _wrong_effects(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Effects that there are not, and values that they do not take."""
    for name, values in _tables(document, "effects"):
        if not isinstance(values, dict):
            yield ("effects", name), f"expected a table of values, got {values!r}"
        elif name not in EFFECTS:
            yield ("effects", name), unknown(name, sorted(EFFECTS)).replace("key", "effect")
        else:
            yield from _wrong_values(name, values)


def _wrong_values(name: str, values: Mapping[str, Any]) -> Iterator[Problem]:
    parameters = {parameter.name: parameter for parameter in EFFECTS[name].parameters}
    for key in (key for key in parameters if key not in values):
        yield ("effects", name), f"{key} is missing ({_meaning(parameters[key])})"
    for key, value in values.items():
        path = ("effects", name, key)
        if key not in parameters:
            yield path, unknown(key, sorted(parameters)).replace("key", "parameter")
        elif problem := _wrong_number(value, *parameters[key].bounds):
            yield path, f"{problem} {parameters[key].unit}, got {value!r} ({parameters[key].meaning})"


def _wrong_deviations(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Standard deviations of what is not in the model, or that are none."""
    effects = dict(_tables(document, "effects"))
    for name, values in _tables(document, "standard_deviations"):
        known = effects.get(name)
        if not isinstance(known, dict) or not isinstance(values, dict):
            yield ("standard_deviations", name), "expected a table of an effect of this model"
            continue
        for key, value in values.items():
            path = ("standard_deviations", name, key)
            if key not in known:
                yield path, unknown(key, sorted(known)).replace("key", "parameter")
            elif problem := _wrong_number(value, 0.0, float("inf")):
                yield path, f"{problem}, got {value!r}"


def _wrong_number(value: object, low: float, high: float) -> str | None:
    if isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high:
        return None
    return f"expected a number within {low:g} ... {high:g}"


def _tables(document: Mapping[str, Any], name: str) -> Iterator[tuple[str, Any]]:
    table = document.get(name)
    yield from table.items() if isinstance(table, dict) else ()
