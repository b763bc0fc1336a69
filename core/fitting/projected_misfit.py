"""How well can a model do at one choice of the parameters that its force is not proportional to?

Variable projection (Golub and Pereyra 1973): the force is proportional to the others, whose best values follow by
linear least squares.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.effect import Parameter
from core.effects import EFFECTS
from core.fitting.layer_columns import Evidence, columns, groups
from core.model.isolator import Isolator, Key

DEGENERATE = 1e-9
"""Share of a column's power that must be its own, else the others can do all that it does."""


@dataclass(frozen=True, slots=True)
class Search:
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


def parameter(key: Key) -> Parameter:
    """Of an effect."""
    return next(one for one in EFFECTS[key[0]].parameters if one.name == key[1])


def search_of(model: Isolator) -> Search:
    """Every parameter of the model's effects but those they hold."""
    keys = [(name, one.name) for name in model.effects for one in EFFECTS[name].parameters]
    free = [key for key in keys if key[1] not in EFFECTS[key[0]].held]
    linear = tuple(key for key in free if key[1] in EFFECTS[key[0]].linear)
    return Search(linear, tuple(key for key in free if key not in linear), groups(model.effects))


def values_of(model: Isolator) -> dict[Key, float]:
    """Of every parameter."""
    return {(name, key): value for name, values in model.effects.items() for key, value in values.items()}


def model_of(values: Mapping[Key, float], names: Sequence[str]) -> Isolator:
    """With these effects, at the values of their parameters."""
    return Isolator({name: {key[1]: value for key, value in values.items() if key[0] == name} for name in names})


def derivatives(evidence: Evidence, search: Search, values: Mapping[Key, float], wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) derivatives of the whitened force by parameters, group by group."""
    found = np.empty((len(wanted), evidence.target.size))
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
        found[rows] = scales[:, None] * columns(evidence, model_of(unit, group), own)
    return found


def projected(evidence: Evidence, search: Search, values: Mapping[Key, float]) -> Point:
    """The best values of the linear parameters for the nonlinear ones there are."""
    linear = derivatives(evidence, search, values, search.linear)
    if not np.isfinite(linear).all():  # a law too fast for the records at these values
        return Point(dict(values), np.inf, evidence.target, np.zeros_like(linear))
    best = _least_squares(linear, evidence.target, [parameter(key).bounds for key in search.linear])
    residual = evidence.target - best @ linear
    found = {**values, **dict(zip(search.linear, best, strict=True))}
    return Point(found, 0.5 * float(residual @ residual) + _penalty(search, found), residual, linear)


def _penalty(search: Search, values: Mapping[Key, float]) -> float:
    return 0.5 * sum(off_prior(key, values) ** 2 for key in search.nonlinear)


def off_prior(key: Key, values: Mapping[Key, float]) -> float:
    """Standard deviations by which a value is off its prior.

    Nothing is believed of an instant: its prior's spread is only how far a step may go.
    """
    one = parameter(key)
    return 0.0 if one.is_instant else one.prior.residual(values[key])


def _least_squares(rows: Matrix, target: Vector, bounds: Sequence[tuple[float, float]]) -> Vector:
    """Least squares within bounds: a value that would leave its range stays at the end of it."""
    scale = np.linalg.norm(rows, axis=1)
    free = [int(row) for row in np.flatnonzero(scale > 0)]
    best = np.array([low if low > 0 else 0.0 for low, _ in bounds])
    while free:
        rest = target - np.delete(best, free) @ np.delete(rows, free, axis=0)
        solved = _solved(rows[free] / scale[free, None], rest) / scale[free]
        within = np.clip(solved, *np.array([bounds[row] for row in free]).T)
        best[free] = within
        outside = [row for row, a, b in zip(free, solved, within, strict=True) if a != b]
        if not outside:
            break
        free = [row for row in free if row not in outside]
    return best


def _solved(rows: Matrix, target: Vector) -> Vector:
    values, vectors = linalg.eigh(rows @ rows.T)
    kept = values > DEGENERATE * values[-1]
    projected = vectors[:, kept].T @ (rows @ target)
    return np.asarray(vectors[:, kept] @ (projected / values[kept]))
