"""How well can a model do at one choice of the parameters that its force is not proportional to?

Variable projection (Golub and Pereyra 1973): the force is proportional to the others, whose best values follow by
linear least squares.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.effects import EFFECTS
from core.fitting.data import FitData, columns, groups
from core.model.isolator import Isolator, Key, parameter
from core.optimisation import bounded_least_squares

LARGEST = 1e100
"""Derivative of a whitened force whose square can still be summed."""


@dataclass(frozen=True, slots=True)
class FreeParameters:
    """What is searched for."""

    linear: tuple[Key, ...]
    """Parameters that the force is proportional to."""
    nonlinear: tuple[Key, ...]
    groups: tuple[tuple[str, ...], ...]
    """Of effects that know nothing of each other."""

    @property
    def count(self) -> int:
        """Of parameters."""
        return len(self.linear) + len(self.nonlinear)


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """The misfit at one choice of the nonlinear parameters."""

    values: dict[Key, float]
    cost: float
    """Half of chi-square, the priors' share included; infinite where a law is too fast for the records."""
    residual: Vector
    linear: Matrix
    """(linear, m)"""


def free_parameters(model: Isolator) -> FreeParameters:
    """Every parameter of the model's effects but those they hold."""
    keys = [(name, one.name) for name in model.effects for one in EFFECTS[name].parameters]
    free = [key for key in keys if key[1] not in EFFECTS[key[0]].held]
    linear = tuple(key for key in free if key[1] in EFFECTS[key[0]].linear)
    return FreeParameters(linear, tuple(key for key in free if key not in linear), groups(model.effects))


def values_of(model: Isolator) -> dict[Key, float]:
    """Of every parameter."""
    return {(name, key): value for name, values in model.effects.items() for key, value in values.items()}


def model_of(values: Mapping[Key, float], names: Sequence[str]) -> Isolator:
    """With these effects, at the values of their parameters."""
    return Isolator({name: {key[1]: value for key, value in values.items() if key[0] == name} for name in names})


def diverges(turned: Matrix) -> bool:
    """Whether derivatives of the force are infinite, not a number or absurdly large: a law is too fast for the records,
    or grows beyond all bounds, at these values."""
    return not bool(np.all(np.abs(turned) < LARGEST))


def derivatives(data: FitData, search: FreeParameters, values: Mapping[Key, float], wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) derivatives of the whitened force by parameters, group by group."""
    found = np.empty((len(wanted), data.target.size))
    for group in search.groups:
        rows = [row for row, key in enumerate(wanted) if key[0] in group]
        if not rows:
            continue
        proportional = [key for key in search.linear if key[0] in group]
        unit, scale = dict(values), 1.0
        if len(proportional) == 1:  # what it does is known for any value of that parameter, once it is for one
            unit[proportional[0]] = parameter(proportional[0]).prior.median
            scale = values[proportional[0]] / unit[proportional[0]]
        own = [wanted[row] for row in rows]
        scales = np.array([1.0 if key in proportional else scale for key in own])
        found[rows] = scales[:, None] * columns(data, model_of(unit, group), own)
    return found


def projected(data: FitData, search: FreeParameters, values: Mapping[Key, float]) -> Point:
    """The best values of the linear parameters for the nonlinear ones there are."""
    linear = derivatives(data, search, values, search.linear)
    if diverges(linear):
        return Point(dict(values), np.inf, data.target, np.zeros_like(linear))
    best = bounded_least_squares(linear, data.target, [parameter(key).bounds for key in search.linear])
    residual = data.target - best @ linear
    found = {**values, **dict(zip(search.linear, best, strict=True))}
    return Point(found, 0.5 * float(residual @ residual) + _penalty(search, found), residual, linear)


def _penalty(search: FreeParameters, values: Mapping[Key, float]) -> float:
    return 0.5 * sum(off_prior(key, values) ** 2 for key in search.nonlinear)


def off_prior(key: Key, values: Mapping[Key, float]) -> float:
    """Standard deviations by which a value is off its prior.

    Nothing is believed of an instant: its prior's spread is only how far a step may go.
    """
    one = parameter(key)
    return 0.0 if one.is_instant else one.prior.residual(values[key])


def is_clamped(key: Key, values: Mapping[Key, float]) -> bool:
    """Whether a value is at an end of its range."""
    return values[key] in parameter(key).bounds
