"""Which values of a model's parameters do the records ask for?"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import ModelError
from core.fitting.descent import Descent, Outcome, advanced, begun
from core.fitting.layer_columns import Evidence
from core.fitting.projected_misfit import (
    DEGENERATE,
    Point,
    derivatives,
    diverges,
    model_of,
    parameter,
    projected,
    search_of,
    values_of,
)
from core.model.isolator import Isolator, Key


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A model at the values that the records ask for."""

    model: Isolator
    free: tuple[Key, ...]
    """Parameters that were fitted: those that the force is proportional to, then the others."""
    covariance: Matrix
    """(free, free) of their values in SI units, by the noise that the evidence is weighed with."""
    chi_square: float
    """Of what is left over, in units of that noise; infinite of a fit that diverged."""
    residual: Vector
    """(m,) whitened, measured less modelled."""
    outcome: Outcome
    undetermined: tuple[Key, ...]
    """Parameters of whose effect the others can do all."""

    @property
    def std(self) -> Mapping[Key, float]:
        """Of every fitted value."""
        return dict(zip(self.free, np.sqrt(np.diag(self.covariance)), strict=True))


def tangents(evidence: Evidence, fit: Fit) -> Matrix:
    """(free, m) derivatives of the whitened force by every fitted parameter."""
    return derivatives(evidence, search_of(fit.model), values_of(fit.model), fit.free)


def signature(evidence: Evidence, base: Fit, model: Isolator) -> Matrix:
    """(k, m) what effects that the base does not have do to the whitened force, at their values in the model.

    By each of their parameters that the force is proportional to; if they scale what others do, all in one.
    """
    search, values = search_of(model), values_of(model)
    own = [key for key in search.linear if key[0] not in base.model.effects]
    if own:
        return derivatives(evidence, search, values, own)
    alone = search_of(base.model)
    with_it, without = (
        np.array([values[key] for key in one.linear]) @ derivatives(evidence, one, values, one.linear)
        for one in (search, alone)
    )
    return np.asarray(with_it - without)[None]


def chi_square(evidence: Evidence, model: Isolator) -> float:
    """Of what the model leaves over at the values that it has, all of them."""
    search, values = search_of(model), values_of(model)
    amplitudes = np.array([values[key] for key in search.linear])
    return float(np.sum((evidence.target - amplitudes @ derivatives(evidence, search, values, search.linear)) ** 2))


def at_values(evidence: Evidence, model: Isolator) -> Fit:
    """The model at the nonlinear values that it has, which count as known: only the others are fitted."""
    search = search_of(model)
    outcome = Outcome.STOPPED if search.nonlinear else Outcome.SETTLED
    point = projected(evidence, search, values_of(model))
    return _result(point, search.linear, point.linear, outcome)


def fitted(evidence: Evidence, model: Isolator) -> Fit:
    """The model with the parameters of all its effects fitted, from the values it has, but those they hold.

    Args:
        evidence: the records, weighed.
        model: effects, and values to start from.
    """
    search = begun(evidence, model)
    while search.outcome is None:
        search = advanced(evidence, search)
    return ended(evidence, search, search.outcome)


def finite_fit(evidence: Evidence, model: Isolator) -> Fit:
    """The same of a model that must have a fit.

    Raises:
        ModelError: its force grows beyond all bounds.
    """
    found = fitted(evidence, model)
    if found.outcome is Outcome.DIVERGED:
        raise ModelError(
            f"{found.outcome.value}, with {', '.join(model.effects)}: start from other values, or leave an effect out"
        )
    return found


def ended(evidence: Evidence, search: Descent, outcome: Outcome) -> Fit:
    """Where a search has come to.

    Args:
        evidence: the records that it was made by.
        search: that has ended, or that nobody goes on with.
        outcome: how it ended.
    """
    free = (*search.search.linear, *search.search.nonlinear)
    if outcome is Outcome.DIVERGED:
        return _diverged(search.point, free)
    nonlinear = derivatives(evidence, search.search, search.point.values, search.search.nonlinear)
    return _result(search.point, free, np.concatenate([search.point.linear, nonlinear]), outcome)


def _result(point: Point, free: tuple[Key, ...], turned: Matrix, outcome: Outcome) -> Fit:
    """By (free, m) derivatives of the whitened force."""
    if not np.isfinite(point.cost) or diverges(turned):
        return _diverged(point, free)
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
        model=_model(point),
        free=free,
        covariance=covariance,
        chi_square=float(point.residual @ point.residual),
        residual=point.residual,
        outcome=outcome,
        undetermined=tuple(sorted(lost)),
    )


def _diverged(point: Point, free: tuple[Key, ...]) -> Fit:
    """No fit: nothing of it is known, and it leaves over more than anything else would."""
    return Fit(
        model=_model(point),
        free=free,
        covariance=np.full((len(free), len(free)), np.nan),
        chi_square=np.inf,
        residual=point.residual,
        outcome=Outcome.DIVERGED,
        undetermined=free,
    )


def _model(point: Point) -> Isolator:
    return model_of(point.values, tuple(dict.fromkeys(key[0] for key in point.values)))
