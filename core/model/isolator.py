"""Model of the isolation layer: its effects with their parameter values, and the conditions that it is exposed to."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np

from core.arrays import Indices, Mask, Matrix, Vector
from core.effect import Parameter
from core.effects import EFFECTS, Laws, laws
from core.errors import ModelError
from core.frozen import FrozenDict
from core.model.program import in_opcode_order, opcodes
from core.rounding import plain
from core.tables import Table, report
from core.units import shown, unit

Key = tuple[str, str]
"""Names of an effect and of one of its parameters or states."""
States = TypeVar("States", Vector, Matrix)


@dataclass(frozen=True, slots=True)
class Isolator:
    """Effects by name, each with the values of all its parameters."""

    effects: Mapping[str, Mapping[str, float]]
    """Values by effect and parameter; parameters that are not given take the median of their prior."""

    def __post_init__(self) -> None:
        complete = {name: _completed(name, values) for name, values in self.effects.items()}
        for name, values in complete.items():
            _check(name, values)
        effects = FrozenDict({name: FrozenDict(values) for name, values in complete.items()})
        object.__setattr__(self, "effects", effects)

    @classmethod
    def of_all_values(cls, effects: Mapping[str, Mapping[str, float]]) -> "Isolator":
        """A model whose effects are given with the values of all parameters; those that choose the form of a law may be
        left out, as in models from before the law had several.

        Raises:
            ModelError: an effect or a value is missing, unknown or out of its range.
        """
        complete = {name: _in_usual_form(name) | dict(values) for name, values in effects.items()}
        for name, values in complete.items():
            _check(name, values)
        return cls(complete)

    def __str__(self) -> str:
        rows = tuple(
            (name, one.name, plain(shown(values[one.name], one.unit)), unit(one.unit), one.meaning)
            for name, values in self.effects.items()
            for one in EFFECTS[name].parameters
        )
        headings = ("effect", "parameter", "value", "unit", "meaning")
        values_table = Table("Values", headings, rows, texts=("parameter", "unit", "meaning"))
        return report(f"Isolation layer: {', '.join(self.effects)}", values_table)


@dataclass(frozen=True, slots=True, eq=False)
class PackedModel:
    """A model as arrays for the force program; see core.model.program.force_program_source."""

    laws: Laws
    """Effects of the program that is compiled for it."""
    opcode: Indices
    at_p: Indices
    at_x: Indices
    p: Vector
    states: int


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """Conditions that the layer is exposed to besides its own motion, at every sample."""

    u_cross: Vector
    """(n,) m, displacement in the other horizontal direction."""
    v_cross: Vector
    """(n,) m/s."""
    axial_load: Vector
    """(n,) vertical force / weight, 1 at rest."""
    temperature: Vector
    """(n,) °C."""
    time: Vector
    """(n,) s since the model's reference instant."""
    ground: Vector
    """(n,) m/s², acceleration of the ground in the direction of the force; 0 where it was not measured."""

    def __post_init__(self) -> None:
        shapes = {field.name: getattr(self, field.name).shape for field in fields(self)}
        if len(set(shapes.values())) > 1 or self.time.ndim != 1:
            raise ModelError(f"conditions must be alike vectors, got {shapes}")

    @classmethod
    def usual(cls, count: int, rate: float) -> "Conditions":
        """Motion in one direction only, dead load, 20 °C, from the reference instant, ground that is not accelerated.

        Args:
            count: number of samples.
            rate: Hz.
        """
        zero, one = np.zeros(count), np.ones(count)
        time = np.arange(count) / rate
        return cls(u_cross=zero, v_cross=zero, axial_load=one, temperature=20 * one, time=time, ground=zero)

    @property
    def rows(self) -> Matrix:
        """(n, 6) in the order of the fields, as the force program reads them."""
        return np.column_stack([getattr(self, field.name) for field in fields(self)])


def packed(isolator: Isolator) -> PackedModel:
    """The model as arrays, the effects that scale others first."""
    known, names = laws(), _packing(isolator)
    effects = [EFFECTS[name] for name in names]
    sizes = [len(effect.parameters) for effect in effects]
    states = [len(effect.states) for effect in effects]
    return PackedModel(
        laws=known,
        opcode=np.array([opcodes(known)[name] for name in names], dtype=np.intp),
        at_p=np.cumsum([0, *sizes])[: len(names)].astype(np.intp),
        at_x=np.cumsum([0, *states])[: len(names)].astype(np.intp),
        p=np.array([isolator.effects[name][parameter] for name, parameter in parameter_names(isolator)], dtype=float),
        states=sum(states),
    )


def parameter(key: Key) -> Parameter:
    """Description of an effect's parameter."""
    return next(one for one in EFFECTS[key[0]].parameters if one.name == key[1])


def unusual_forms(isolator: Isolator, effect: str) -> tuple[str, ...]:
    """Names of the parameters by which the law of a model's effect has another form than the usual one."""
    values = isolator.effects[effect]
    return tuple(name for name in EFFECTS[effect].forms if values[name] != parameter((effect, name)).prior.median)


def parameter_names(isolator: Isolator) -> tuple[Key, ...]:
    """Names of all parameters of the model, in packed order."""
    return tuple((name, parameter.name) for name in _packing(isolator) for parameter in EFFECTS[name].parameters)


def state_names(isolator: Isolator) -> tuple[Key, ...]:
    """Names of all states of the model, in packed order."""
    return tuple((name, state) for name in _packing(isolator) for state in EFFECTS[name].states)


def carried(isolator: Isolator, states: States) -> States:
    """States at the start of an earthquake from those at the end of the previous one; states not carried over are zero.

    Args:
        isolator: the model.
        states: (..., m) in the order of state_names: states, or their derivatives.
    """
    initial: States = np.where(are_carried(isolator), states, 0.0)
    return initial


def are_carried(isolator: Isolator) -> Mask:
    """(m,) which states are carried over, in the order of state_names."""
    return np.array([state in EFFECTS[name].carried for name, state in state_names(isolator)], dtype=bool)


def _packing(isolator: Isolator) -> tuple[str, ...]:
    return in_opcode_order({name: EFFECTS[name] for name in isolator.effects})


def _parameters(name: str) -> Mapping[str, Parameter]:
    if name not in EFFECTS:
        raise ModelError(f"there is no effect {name!r}; there are {', '.join(sorted(EFFECTS))}")
    return {parameter.name: parameter for parameter in EFFECTS[name].parameters}


def _completed(name: str, values: Mapping[str, float]) -> Mapping[str, float]:
    parameters = _parameters(name)
    if len(values) >= len(parameters):
        return values
    return {one.name: one.prior.median for one in parameters.values()} | dict(values)


def _in_usual_form(name: str) -> dict[str, float]:
    return {key: one.prior.median for key, one in _parameters(name).items() if key in EFFECTS[name].forms}


def _check(name: str, values: Mapping[str, float]) -> None:
    parameters = _parameters(name)
    if set(values) != set(parameters):
        raise ModelError(f"{name} takes values for {sorted(parameters)}, got {sorted(values)}")
    for key, value in values.items():
        low, high = parameters[key].bounds
        if not low <= value <= high:
            raise ModelError(
                f"{name}: {key} must lie within {low:g} ... {high:g} {parameters[key].unit}, got {value:g}"
            )
