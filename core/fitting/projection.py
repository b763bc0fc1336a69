"""Misfit of a model as a function of its nonlinear parameters.

Variable projection (Golub and Pereyra 1973): the force is proportional to the other, linear parameters, whose best
values follow from linear least squares within their bounds.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.effects import EFFECTS
from core.fitting.data import FitData, Wanted, columns, groups
from core.model.isolator import Isolator, Key, parameter
from core.optimisation import bounded_least_squares

LARGEST = 1e100
"""Largest derivative of a whitened force that counts as finite: its square can still be summed in double precision."""


@dataclass(frozen=True, slots=True)
class FreeParameters:
    """Parameters that a fit determines."""

    linear: tuple[Key, ...]
    """Parameters that the force is proportional to."""
    nonlinear: tuple[Key, ...]
    groups: tuple[tuple[str, ...], ...]
    """Independent groups of effects; see core.fitting.data.groups."""

    @property
    def count(self) -> int:
        """Number of parameters."""
        return len(self.linear) + len(self.nonlinear)


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """The misfit at one choice of the nonlinear parameters."""

    values: dict[Key, float]
    cost: float
    """Half of chi-square, with the priors' part; infinite where a law is too fast for the records."""
    residual: Vector
    """(m,) whitened, measured less modelled."""
    linear: Matrix
    """(linear, m) derivatives of the whitened force by the linear parameters."""


def free_parameters(model: Isolator, zero: Collection[Key] = (), also: Collection[Key] = ()) -> FreeParameters:
    """All parameters of the model's effects except those that a fit leaves alone.

    Args:
        model: effects and values.
        zero: parameters that the force is proportional to, and that stay 0.
        also: parameters that a fit usually leaves alone, and that are free here.
    """
    keys = [(name, one.name) for name in model.effects for one in EFFECTS[name].parameters]
    keys = [key for key in keys if key not in zero]
    free = [key for key in keys if key in also or key[1] not in EFFECTS[key[0]].held]
    linear = tuple(key for key in free if key[1] in EFFECTS[key[0]].linear)
    return FreeParameters(linear, tuple(key for key in free if key not in linear), groups(model.effects))


def values_of(model: Isolator) -> dict[Key, float]:
    """Values of all parameters."""
    return {(name, key): value for name, values in model.effects.items() for key, value in values.items()}


def model_of(values: Mapping[Key, float], names: Sequence[str]) -> Isolator:
    """Model of the named effects at these values."""
    return Isolator({name: {key[1]: value for key, value in values.items() if key[0] == name} for name in names})


def diverges(turned: Matrix) -> bool:
    """True if derivatives of the force are infinite, NaN or beyond LARGEST: a law is too fast for the records, or its
    force diverges, at these values."""
    return not bool(np.all(np.abs(turned) < LARGEST))


def derivatives(data: FitData, search: FreeParameters, values: Mapping[Key, float], wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) derivatives of the whitened force by parameters, group by group."""
    return data.whitened(coefficients(data, search, values, wanted))


def coefficients(data: FitData, search: FreeParameters, values: Mapping[Key, float], wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) N, derivatives of the force's coefficients by parameters, group by group."""
    by_parameter = np.empty((len(wanted), data.target.size))
    for rows, scales, (model, own) in _by_group(search, values, wanted):
        by_parameter[rows] = scales[:, None] * columns(data, model, own)
    return by_parameter


def wanted_columns(search: FreeParameters, values: Mapping[Key, float], wanted: Sequence[Key]) -> Iterator[Wanted]:
    """Columns that `coefficients` needs."""
    return (one for _, _, one in _by_group(search, values, wanted))


def _by_group(
    search: FreeParameters, values: Mapping[Key, float], wanted: Sequence[Key]
) -> Iterator[tuple[list[int], Vector, Wanted]]:
    """Rows of the wanted parameters, factors of their columns, and the columns."""
    for group in search.groups:
        rows = [row for row, key in enumerate(wanted) if key[0] in group]
        if not rows:
            continue
        proportional = [key for key in search.linear if key[0] in group]
        unit, scale = dict(values), 1.0
        if len(proportional) == 1:  # one computation serves all its values
            unit[proportional[0]] = parameter(proportional[0]).prior.median
            scale = values[proportional[0]] / unit[proportional[0]]
        own = tuple(wanted[row] for row in rows)
        scales = np.array([1.0 if key in proportional else scale for key in own])
        yield rows, scales, (model_of(unit, group), own)


def projected(data: FitData, search: FreeParameters, values: Mapping[Key, float]) -> Point:
    """Point at the best values of the linear parameters, the nonlinear ones fixed."""
    linear = derivatives(data, search, values, search.linear)
    if diverges(linear):
        return Point(dict(values), np.inf, data.target, np.zeros_like(linear))
    best = bounded_least_squares(linear, data.target, [parameter(key).bounds for key in search.linear])
    residual = data.target - best @ linear
    fitted = {**values, **dict(zip(search.linear, best, strict=True))}
    return Point(fitted, 0.5 * float(residual @ residual) + _penalty(search, fitted), residual, linear)


def _penalty(search: FreeParameters, values: Mapping[Key, float]) -> float:
    return 0.5 * sum(off_prior(key, values) ** 2 for key in search.nonlinear)


def off_prior(key: Key, values: Mapping[Key, float]) -> float:
    """Distance of a value from its prior's median in standard deviations.

    0 for an instant, which has no prior: its spread only limits the steps.
    """
    one = parameter(key)
    return 0.0 if one.is_instant else one.prior.residual(values[key])


def is_clamped(key: Key, values: Mapping[Key, float]) -> bool:
    """True if a value is at a bound."""
    return values[key] in parameter(key).bounds
