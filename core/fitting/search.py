"""Search for the values of a model's parameters, in steps, so that several searches can take turns.

The method of Levenberg and Marquardt over the parameters that the force is not proportional to (core.fitting.projection
finds the others), with Kaufman's (1975) approximation of the projection's derivative. The derivatives are those of the
integrated laws, exact to rounding.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.effect import LogNormal
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.projection import (
    FreeParameters,
    Point,
    derivatives,
    diverges,
    free_parameters,
    is_clamped,
    off_prior,
    projected,
    values_of,
)
from core.model.isolator import Isolator, Key, parameter
from core.optimisation import Damping, FactorDamping, Quadratic, Step, lower_point

SETTLED = 0.05
"""Reduction of the cost (half of chi-square) below which a search ends; a choice: 1.92 is significant at 5 %."""
RELATIVE = 1e-5
"""Reduction relative to the cost below which the search ends, for models whose residual is far above the noise. A
choice."""
LONGEST_STEP = 1.0
"""Longest change in one step: of a logarithm, or in standard deviations of the prior. A choice."""
MOST_STEPS = 40
"""Steps after which a search is stopped. A choice."""
FIRST_DAMPING = FactorDamping(value=1e-3, divisor=8.0, multiplier=8.0, smallest=1e-8)
"""Damping of the first step, relative to the diagonal, and its changes. Not tuned: a step is a change of less than
LONGEST_STEP, so that few trials fail."""
MOST_TRIALS = 8
"""Trials of larger damping in one step. A choice."""
ALIGNED = 0.9
"""Smallest cosine between two successive steps for which the second one is stretched. A choice."""
MOST_STRETCHED = 4.0
"""Largest factor by which a step is stretched. A choice."""
SAME = 0.2
"""Largest difference of every value, as in LONGEST_STEP, from a known minimum that a search may lead to. A choice."""
NEARER = 0.8
"""Ratio of the distances to that minimum after and before the next step, below which the step leads there. A choice."""
NEGLIGIBLE = 0.25
"""Share of SETTLED, or of RELATIVE, below which a predicted reduction ends a search before the step: where the residual
is large, a step may gain several times what is predicted. A choice."""
TINY = 1e-300
"""A smaller number counts as this before its logarithm or its inverse is taken."""


class Outcome(Enum):
    """Reason for the end of a search."""

    SETTLED = "the misfit has a minimum here"
    AT_BOUND = "a parameter went to the end of its range"
    UNDETERMINED = "the records do not determine every parameter"
    STOPPED = "the search was stopped before it settled"
    DIVERGED = "the model's force, or its derivatives, grew beyond all bounds"


@dataclass(frozen=True, slots=True, eq=False)
class LocalQuadratic:
    """Quadratic approximation of the cost about a point."""

    quadratic: Quadratic
    """(free, free) Gauss-Newton matrix and (free,) negative gradient."""
    free: tuple[int, ...]
    """Indices of the nonlinear parameters that may move: not those that a bound stops."""
    diverges: bool = False
    """True if derivatives are not finite, so that there is no approximation."""

    @property
    def predicted_gain(self) -> float:
        """Reduction of the cost at the minimum of the quadratic."""
        step = self.quadratic.step(FIRST_DAMPING.value)
        return 0.0 if step is None else 0.5 * float(self.quadratic.descent @ step)


NO_QUADRATIC = LocalQuadratic(Quadratic(np.zeros((0, 0)), np.zeros(0)), ())
"""Approximation where no nonlinear parameter may move."""


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """State of a search between two steps."""

    search: FreeParameters
    point: Point
    slope: LocalQuadratic
    damping: Damping
    steps: int
    gained: float
    """Reduction of the cost by the last step."""
    outcome: Outcome | None
    """None while the search continues."""
    last: Vector | None = None
    """(nonlinear,) last step of the search variables; None if there is none, or if it was shortened or failed."""
    stretch: float = 1.0
    """Factor by which the last step was stretched."""

    @property
    def cost(self) -> float:
        """Cost of the point; infinite if the search has diverged."""
        return np.inf if self.outcome is Outcome.DIVERGED else self.point.cost

    @property
    def step(self) -> Vector:
        """(nonlinear,) next step of the search variables, before it is shortened or stretched."""
        change = np.zeros(len(self.search.nonlinear))
        free = self.slope.quadratic.step(self.damping.value)
        if free is not None:
            change[list(self.slope.free)] = free
        return change

    @property
    def predicted_gain(self) -> float:
        """Larger of the quadratic's reduction of the cost and of the last step's; 0 after the end."""
        return 0.0 if self.outcome is not None else max(self.slope.predicted_gain, self.gained)


def start_search(data: FitData, model: Isolator, zero: Collection[Key] = (), also: Collection[Key] = ()) -> Search:
    """Search that starts from the model's values.

    Args:
        data: the records.
        model: effects and values.
        zero: parameters that the force is proportional to, and that stay 0.
        also: parameters that are searched for besides those of a fit.
    """
    search = free_parameters(model, zero, also)
    point = projected(data, search, values_of(model))
    slope = _slope(data, search, point)
    outcome = None if slope.free else Outcome.AT_BOUND
    if slope.diverges or not np.isfinite(point.cost):
        outcome = Outcome.DIVERGED
    elif not search.nonlinear:
        outcome = Outcome.SETTLED
    return Search(search, point, slope, FIRST_DAMPING, 0, 0.0, outcome)


def step_search(data: FitData, now: Search) -> Search:
    """Search after one more step.

    Args:
        data: the records.
        now: a search without an outcome.
    """
    change = now.step
    stretch = _stretch(now, change)
    step = _lower_point(data, now, stretch, 1) if stretch > 1.0 else None
    if step is None or not step.gained:
        stretch, step = 1.0, _lower_point(data, now, 1.0, MOST_TRIALS)
    point, gained, damping = (now.point, 0.0, now.damping) if step is None else (step.point, step.gained, step.damping)
    is_whole = gained and damping.value <= now.damping.value and stretch * np.abs(change).max() < LONGEST_STEP
    slope = _slope(data, now.search, point) if gained else now.slope
    least = max(SETTLED, RELATIVE * point.cost)
    outcome: Outcome | None = None
    if slope.diverges:
        outcome = Outcome.DIVERGED
    elif not slope.free:
        outcome = Outcome.AT_BOUND
    elif gained < least or slope.predicted_gain < NEGLIGIBLE * least:
        outcome = Outcome.SETTLED
    elif now.steps + 1 >= MOST_STEPS:
        outcome = Outcome.STOPPED
    last, stretch = (change, stretch) if is_whole else (None, 1.0)
    return Search(now.search, point, slope, damping, now.steps + 1, gained, outcome, last, stretch)


def leads_to(now: Search, known: Search) -> bool:
    """True if a search is on its way to the minimum at which another one has ended.

    Args:
        now: a search.
        known: another search of the same effects.
    """
    if now.outcome is not None or known.outcome not in (Outcome.SETTLED, Outcome.AT_BOUND) or known.cost > now.cost:
        return False
    held = now.point.values.keys() - {*now.search.linear, *now.search.nonlinear}
    if any(now.point.values[key] != known.point.values[key] for key in held):
        return False
    way = _variables(known) - _variables(now)
    ahead = np.linalg.norm(way - now.step) < NEARER * np.linalg.norm(way)
    return bool(np.abs(way).max(initial=0.0) < SAME and ahead)


def _variables(now: Search) -> Vector:
    """(nonlinear,) search variables: logarithms, or values in their units."""
    return np.array([_variable(key, now.point.values) for key in now.search.nonlinear])


def _variable(key: Key, values: Mapping[Key, float]) -> float:
    is_log = isinstance(parameter(key).prior, LogNormal)
    return float(np.log(max(values[key], TINY))) if is_log else values[key] / _unit(key, values)


def _stretch(now: Search, step: Vector) -> float:
    """Factor by which to stretch the next step; 1 where its direction is not that of the last one.

    Where a law leaves much of the force unexplained, the residual adds to the curvature of the cost, and Gauss-Newton
    steps are too short. If each is ρ times the one before, the minimum is 1 / (1 - ρ) steps away (Aitken 1926). After a
    stretched step, the ratio of the two steps corrects its factor.

    Args:
        now: a search without an outcome.
        step: its next step.
    """
    last = now.last
    if last is None:
        return 1.0
    along, size = float(step @ last), float(last @ last)
    if not along > ALIGNED * np.sqrt(size * float(step @ step)):
        return 1.0
    return float(np.clip(now.stretch / max(1 - along / size, TINY), 1.0, MOST_STRETCHED))


def _lower_point(data: FitData, now: Search, stretch: float, trials: int) -> Step[Point] | None:
    """The next step, stretched; as core.optimisation.lower_point returns it."""

    def moved(change: Vector) -> Point:
        return _moved(data, now, stretch * change)

    return lower_point(now.point, now.slope.quadratic, moved, now.damping, trials)


def _unit(key: Key, values: Mapping[Key, float]) -> float:
    """Change of the value per unit of the search variable: of its logarithm, or of its prior's spread.

    That of an instant is the duration of the change then, if it is longer.
    """
    prior = parameter(key).prior
    if isinstance(prior, LogNormal):
        return values[key]
    takes = EFFECTS[key[0]].sets_in if parameter(key).is_instant else None
    return prior.spread if takes is None else max(prior.spread, values[key[0], takes])


def _slope(data: FitData, search: FreeParameters, point: Point) -> LocalQuadratic:
    if not search.nonlinear or not np.isfinite(point.cost):
        return NO_QUADRATIC
    units = np.array([_unit(key, point.values) for key in search.nonlinear])
    turned = units[:, None] * derivatives(data, search, point.values, search.nonlinear)
    if diverges(turned):
        return replace(NO_QUADRATIC, diverges=True)
    basis = linalg.orth(_adapting(search, point).T)
    own = turned - (turned @ basis) @ basis.T
    priors = [parameter(key).prior for key in search.nonlinear]
    off = np.array([off_prior(key, point.values) for key in search.nonlinear])
    slope = np.array([1 / p.spread if isinstance(p, LogNormal) else 1.0 for p in priors])
    normal = own @ own.T + np.diag(slope**2)
    descent = own @ point.residual - off * slope
    free = [
        row
        for row, key in enumerate(search.nonlinear)
        if parameter(key).bounds[0] < point.values[key] < parameter(key).bounds[1]
        or (descent[row] > 0) == (point.values[key] <= parameter(key).bounds[0])
    ]
    return LocalQuadratic(Quadratic(normal[np.ix_(free, free)], descent[free]), tuple(free))


def _adapting(search: FreeParameters, point: Point) -> Matrix:
    """(k, m) unit derivatives by the linear parameters that adapt to a change of the others: not those at a bound."""
    scale = np.linalg.norm(point.linear, axis=1)
    clamped = np.array([is_clamped(key, point.values) for key in search.linear], dtype=bool)
    follows = (scale > 0) & ~clamped
    return np.asarray(point.linear[follows] / scale[follows, None])


def _moved(data: FitData, now: Search, step: Vector) -> Point:
    """Point after a step of the search variables, shortened to LONGEST_STEP and ended at the bounds."""
    step = step * (LONGEST_STEP / max(LONGEST_STEP, float(np.abs(step).max())))
    values = dict(now.point.values)
    for row, change in zip(now.slope.free, step, strict=True):
        key = now.search.nonlinear[row]
        is_log = isinstance(parameter(key).prior, LogNormal)
        new = values[key] * np.exp(change) if is_log else values[key] + change * _unit(key, values)
        values[key] = float(np.clip(new, *parameter(key).bounds))
    return projected(data, now.search, values)
