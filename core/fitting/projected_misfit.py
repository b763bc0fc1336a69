"""How well can a model do at one choice of the parameters that its force is not proportional to?

Variable projection (Golub and Pereyra 1973): the force is proportional to the others, whose best values follow by
linear least squares.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg
from scipy.optimize import lsq_linear

from core.arrays import Matrix, Vector
from core.effect import Parameter
from core.effects import EFFECTS
from core.fitting.layer_columns import Evidence, columns, groups
from core.model.isolator import Isolator, Key

DEGENERATE = 1e-9
"""Share of a column's power that must be its own, else the others can do all that it does."""
SMALLEST = 1e-12
"""The same within bounds, where a share is raised to it instead of left out: bounds keep the amplitudes small."""
TOLERANCE = 1e-12
"""Of the cost: a change of the bounds that are met gains more."""
LARGEST = 1e100
"""Derivative of a whitened force whose square can still be summed."""
MOST_CHANGES = 20
"""Of the bounds that are met, for each amplitude."""


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


def diverges(turned: Matrix) -> bool:
    """Whether derivatives of the force are infinite, not a number or absurdly large: a law is too fast for the records,
    or grows beyond all bounds, at these values."""
    return not bool(np.all(np.abs(turned) < LARGEST))


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
    if diverges(linear):
        return Point(dict(values), np.inf, evidence.target, np.zeros_like(linear))
    best = bounded_least_squares(linear, evidence.target, [parameter(key).bounds for key in search.linear])
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


def is_clamped(key: Key, values: Mapping[Key, float]) -> bool:
    """Whether a value is at an end of its range."""
    return values[key] in parameter(key).bounds


def bounded_least_squares(rows: Matrix, target: Vector, bounds: Sequence[tuple[float, float]]) -> Vector:
    """(k,) amplitudes x of least |target − x rows| within bounds; Stark and Parker's (1995) BVLS where they matter.

    Where the amplitudes without bounds are within them, they are the answer. What other rows can do all of gets the
    least amplitudes.

    Args:
        rows: (k, m).
        target: (m,)
        bounds: (k,) smallest and largest amplitude.
    """
    scale = np.linalg.norm(rows, axis=1)
    free = np.flatnonzero(scale > 0)
    low, high = np.array(bounds, dtype=float).reshape(-1, 2).T
    best = np.clip(np.zeros(len(rows)), low, high)
    if not free.size:
        return best
    alike = rows[free] / scale[free, None]
    values, vectors = linalg.eigh(alike @ alike.T)
    kept = values > DEGENERATE * values[-1]
    along = vectors.T @ (alike @ target)
    inside = vectors[:, kept] @ (along[kept] / values[kept]) / scale[free]
    if np.all((low[free] <= inside) & (inside <= high[free])):
        best[free] = inside
        return best
    ends = low[free] * scale[free], high[free] * scale[free]
    size = float(np.linalg.norm(along)) or 1.0
    roots = np.sqrt(np.maximum(values, SMALLEST * values[-1]))
    reduced, wanted = roots[:, None] * vectors.T, along / roots / size
    found = lsq_linear(
        reduced,
        wanted,
        (ends[0] / size, ends[1] / size),
        method="bvls",
        tol=TOLERANCE,
        max_iter=MOST_CHANGES * free.size,
    )
    best[free] = np.clip(found.x * size / scale[free], low[free], high[free])
    best[free[found.active_mask < 0]] = low[free[found.active_mask < 0]]
    best[free[found.active_mask > 0]] = high[free[found.active_mask > 0]]
    return best
