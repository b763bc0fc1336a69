"""Which values of a model's parameters do the records ask for?

Variable projection (Golub and Pereyra 1973): the force is proportional to some parameters, whose best values follow
from the others by linear least squares; the search is over the others alone, by Levenberg and Marquardt's method with
Kaufman's (1975) approximation of the projection's derivative. The derivatives are exact, those of the integrated laws.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.effect import LogNormal, Normal, Parameter
from core.effects import EFFECTS
from core.isolator import Isolator, Key
from core.layer_columns import Evidence, columns, groups

SETTLED = 0.05
"""Of half of chi-square: a step that gains less ends the search, or less than RELATIVE of it."""
RELATIVE = 1e-5
LONGEST_STEP = 1.0
"""Of a logarithm, or of a prior's standard deviation."""
MOST_STEPS = 40
DEGENERATE = 1e-9
"""Share of a column's power that must be its own, else the others can do all that it does."""


class Outcome(Enum):
    """How a search ended, in words."""

    SETTLED = "the misfit has a minimum here"
    AT_BOUND = "a parameter went to the end of its range"
    UNDETERMINED = "the records do not determine every parameter"
    STOPPED = "the search was stopped before it settled"


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A model at the values that the records ask for."""

    model: Isolator
    free: tuple[Key, ...]
    """Parameters that were fitted: those that the force is proportional to, then the others."""
    covariance: Matrix
    """(free, free) of their values in SI units, by the noise that the evidence is weighed with."""
    chi_square: float
    """Of what is left over, in units of that noise."""
    residual: Vector
    """(m,) whitened, measured less modelled."""
    outcome: Outcome
    undetermined: tuple[Key, ...]
    """Parameters of whose effect the others can do all."""

    @property
    def std(self) -> Mapping[Key, float]:
        """Of every fitted value."""
        return dict(zip(self.free, np.sqrt(np.diag(self.covariance)), strict=True))


@dataclass(frozen=True, slots=True)
class _Search:
    """What is searched for, and where."""

    linear: tuple[Key, ...]
    nonlinear: tuple[Key, ...]
    groups: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """The misfit at one choice of the nonlinear parameters."""

    values: dict[Key, float]
    cost: float
    residual: Vector
    linear: Matrix
    """(linear, m)"""


def parameter(key: Key) -> Parameter:
    """Of an effect."""
    return next(one for one in EFFECTS[key[0]].parameters if one.name == key[1])


def tangents(evidence: Evidence, fit: Fit) -> Matrix:
    """(free, m) derivatives of the whitened force by every fitted parameter."""
    return _columns(evidence, _search(fit.model), _values(fit.model), fit.free)


def signature(evidence: Evidence, base: Fit, model: Isolator) -> Matrix:
    """(k, m) what effects that the base does not have do to the whitened force, at their values in the model.

    By each of their parameters that the force is proportional to; if they scale what others do, all in one.
    """
    search, values = _search(model), _values(model)
    own = [key for key in search.linear if key[0] not in base.model.effects]
    if own:
        return _columns(evidence, search, values, own)
    alone = _search(base.model)
    with_it, without = (
        np.array([values[key] for key in one.linear]) @ _columns(evidence, one, values, one.linear)
        for one in (search, alone)
    )
    return np.asarray(with_it - without)[None]


def chi_square(evidence: Evidence, model: Isolator) -> float:
    """Of what the model leaves over at the values that it has, all of them."""
    search, values = _search(model), _values(model)
    amplitudes = np.array([values[key] for key in search.linear])
    return float(np.sum((evidence.target - amplitudes @ _columns(evidence, search, values, search.linear)) ** 2))


def at_values(evidence: Evidence, model: Isolator) -> Fit:
    """The model at the nonlinear values that it has, as a fit by these weights."""
    search = _search(model)
    return _result(evidence, search, _at(evidence, search, _values(model)), Outcome.SETTLED)


def fitted(evidence: Evidence, model: Isolator) -> Fit:
    """The model with the parameters of all its effects fitted, from the values it has, but those they hold.

    Args:
        evidence: the records, weighed.
        model: effects, and values to start from.
    """
    search = _search(model)
    point = _at(evidence, search, _values(model))
    damping, outcome = 1e-3, Outcome.SETTLED if not search.nonlinear else Outcome.STOPPED
    for _ in range(MOST_STEPS if search.nonlinear else 0):
        normal, descent, free = _descent(evidence, search, point)
        if not free:
            outcome = Outcome.AT_BOUND
            break
        better, damping = _step(evidence, search, point, (normal, descent, free), damping)
        gain = 0.0 if better is None else point.cost - better.cost
        point = better or point
        if gain < max(SETTLED, RELATIVE * point.cost):
            outcome = Outcome.SETTLED
            break
    return _result(evidence, search, point, outcome)


def _search(model: Isolator) -> _Search:
    keys = [(name, one.name) for name in model.effects for one in EFFECTS[name].parameters]
    free = [key for key in keys if key[1] not in EFFECTS[key[0]].held]
    linear = tuple(key for key in free if key[1] in EFFECTS[key[0]].linear)
    return _Search(linear, tuple(key for key in free if key not in linear), groups(model.effects))


def _values(model: Isolator) -> dict[Key, float]:
    return {(name, key): value for name, values in model.effects.items() for key, value in values.items()}


def _model(values: Mapping[Key, float], names: Sequence[str]) -> Isolator:
    return Isolator({name: {key[1]: value for key, value in values.items() if key[0] == name} for name in names})


def _columns(evidence: Evidence, search: _Search, values: Mapping[Key, float], wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) derivatives of the force by parameters, group by group."""
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
        found[rows] = scales[:, None] * columns(evidence, _model(unit, group), own)
    return found


def _at(evidence: Evidence, search: _Search, values: Mapping[Key, float]) -> _Point:
    """The best values of the linear parameters for the nonlinear ones there are."""
    linear = _columns(evidence, search, values, search.linear)
    if not np.isfinite(linear).all():  # a law too fast for the records at these values
        return _Point(dict(values), np.inf, evidence.target, np.zeros_like(linear))
    best = _least_squares(linear, evidence.target, [parameter(key).bounds for key in search.linear])
    residual = evidence.target - best @ linear
    found = {**values, **dict(zip(search.linear, best, strict=True))}
    return _Point(found, 0.5 * float(residual @ residual) + _penalty(search, found), residual, linear)


def _penalty(search: _Search, values: Mapping[Key, float]) -> float:
    return 0.5 * sum(_residual(key, values) ** 2 for key in search.nonlinear)


def _residual(key: Key, values: Mapping[Key, float]) -> float:
    """Of the prior; nothing is believed of an instant, and its prior's spread is only how far a step may go."""
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


def _unit(key: Key, value: float) -> float:
    """By how much the value grows with one unit of what is searched: of its logarithm, or of its prior's spread."""
    prior = parameter(key).prior
    return value if isinstance(prior, LogNormal) else prior.spread


def _descent(evidence: Evidence, search: _Search, point: _Point) -> tuple[Matrix, Vector, list[int]]:
    """Gauss and Newton's matrix, the way down, and which nonlinear parameters are not held at a bound."""
    units = np.array([_unit(key, point.values[key]) for key in search.nonlinear])
    turned = units[:, None] * _columns(evidence, search, point.values, search.nonlinear)
    scale = np.linalg.norm(point.linear, axis=1)
    basis = linalg.orth((point.linear[scale > 0] / scale[scale > 0, None]).T)
    own = turned - (turned @ basis) @ basis.T
    priors = [parameter(key).prior for key in search.nonlinear]
    off = np.array([_residual(key, point.values) for key in search.nonlinear])
    slope = np.array([1 / p.spread if isinstance(p, LogNormal) else 1.0 for p in priors])
    normal = own @ own.T + np.diag(slope**2)
    descent = own @ point.residual - off * slope
    free = [
        row
        for row, key in enumerate(search.nonlinear)
        if parameter(key).bounds[0] < point.values[key] < parameter(key).bounds[1]
        or (descent[row] > 0) == (point.values[key] <= parameter(key).bounds[0])
    ]
    return normal[np.ix_(free, free)], descent[free], free


def _step(
    evidence: Evidence,
    search: _Search,
    point: _Point,
    downhill: tuple[Matrix, Vector, list[int]],
    damping: float,
) -> tuple[_Point | None, float]:
    """A better point, None if there is none; and the damping for the next step."""
    normal, descent, free = downhill
    size = np.sqrt(np.diag(normal))
    alike = normal / np.outer(size, size)
    for _ in range(8):
        change = linalg.solve(alike + damping * np.eye(size.size), descent / size, assume_a="pos") / size
        change *= min(1.0, LONGEST_STEP / np.abs(change).max())
        moved = {search.nonlinear[row]: step for row, step in zip(free, change, strict=True)}
        tried = _at(evidence, search, {**point.values, **dict(_moved(point.values, moved))})
        if tried.cost < point.cost:
            return tried, max(damping / 8, 1e-8)
        damping *= 8
    return None, damping


def _moved(values: Mapping[Key, float], steps: Mapping[Key, float]) -> Iterator[tuple[Key, float]]:
    for key, step in steps.items():
        prior: LogNormal | Normal = parameter(key).prior
        new = values[key] * np.exp(step) if isinstance(prior, LogNormal) else values[key] + step * prior.spread
        yield key, float(np.clip(new, *parameter(key).bounds))


def _result(evidence: Evidence, search: _Search, point: _Point, outcome: Outcome) -> Fit:
    free = (*search.linear, *search.nonlinear)
    turned = np.concatenate([point.linear, _columns(evidence, search, point.values, search.nonlinear)])
    scale = np.linalg.norm(turned, axis=1)
    there = np.flatnonzero(scale > 0)
    normal = turned[there] @ turned[there].T / np.outer(scale[there], scale[there])
    values, vectors = linalg.eigh(normal)
    spread = vectors / np.sqrt(np.maximum(values, DEGENERATE * values[-1]))
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(there, there)] = (spread @ spread.T) / np.outer(scale[there], scale[there])
    own = 1 / np.diag(spread @ spread.T)
    lost = {free[row] for row, share in zip(there, own, strict=True) if share < 10 * DEGENERATE}
    lost |= {key for key, size in zip(free, scale, strict=True) if not size > 0}
    ends = [key for key in free if point.values[key] in parameter(key).bounds]
    if any(not parameter(key).is_instant for key in lost):
        outcome = Outcome.UNDETERMINED
    elif ends and outcome is Outcome.SETTLED:
        outcome = Outcome.AT_BOUND
    return Fit(
        model=_model(point.values, tuple(dict.fromkeys(key[0] for key in point.values))),
        free=free,
        covariance=covariance,
        chi_square=float(point.residual @ point.residual),
        residual=point.residual,
        outcome=outcome,
        undetermined=tuple(sorted(lost)),
    )
