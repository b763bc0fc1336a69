"""Which values of a model's parameters do the records ask for?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import ModelError, RecordError
from core.fitting.data import FitData
from core.fitting.noise import pooled_rms
from core.fitting.observation import Observation
from core.fitting.projection import Point, derivatives, diverges, free_parameters, model_of, projected, values_of
from core.fitting.search import Outcome, Search, start_search, step_search
from core.model.isolator import Isolator, Key, parameter
from core.optimisation import DEGENERATE
from core.signals.whitening import reweighted


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A model at the values that the records ask for."""

    model: Isolator
    free: tuple[Key, ...]
    """Parameters that were fitted: those that the force is proportional to, then the others."""
    covariance: Matrix
    """(free, free) of their values in SI units, by the noise that the data is weighed with."""
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


def tangents(data: FitData, fit: Fit) -> Matrix:
    """(free, m) derivatives of the whitened force by every fitted parameter."""
    return derivatives(data, free_parameters(fit.model), values_of(fit.model), fit.free)


def signature(data: FitData, base: Fit, model: Isolator) -> Matrix:
    """(k, m) what effects that the base does not have do to the whitened force, at their values in the model.

    By each of their parameters that the force is proportional to; if they scale what others do, all in one.
    """
    search, values = free_parameters(model), values_of(model)
    own = [key for key in search.linear if key[0] not in base.model.effects]
    if own:
        return derivatives(data, search, values, own)
    alone = free_parameters(base.model)
    with_it, without = (
        np.array([values[key] for key in one.linear]) @ derivatives(data, one, values, one.linear)
        for one in (search, alone)
    )
    return np.asarray(with_it - without)[None]


def chi_square(data: FitData, model: Isolator) -> float:
    """Of what the model leaves over at the values that it has, all of them."""
    search, values = free_parameters(model), values_of(model)
    amplitudes = np.array([values[key] for key in search.linear])
    return float(np.sum((data.target - amplitudes @ derivatives(data, search, values, search.linear)) ** 2))


def at_values(data: FitData, model: Isolator) -> Fit:
    """The model at the nonlinear values that it has, which count as known: only the others are fitted."""
    search = free_parameters(model)
    outcome = Outcome.STOPPED if search.nonlinear else Outcome.SETTLED
    point = projected(data, search, values_of(model))
    return _result(point, search.linear, point.linear, outcome)


def fitted(data: FitData, model: Isolator) -> Fit:
    """The model with the parameters of all its effects fitted, from the values it has, but those they hold.

    Args:
        data: the records, weighed.
        model: effects, and values to start from.
    """
    search = start_search(data, model)
    while search.outcome is None:
        search = step_search(data, search)
    return finish_search(data, search, search.outcome)


def finite_fit(data: FitData, model: Isolator) -> Fit:
    """The same of a model that must have a fit.

    Raises:
        ModelError: its force grows beyond all bounds.
    """
    found = fitted(data, model)
    if found.outcome is Outcome.DIVERGED:
        raise ModelError(
            f"{found.outcome.value}, with {', '.join(model.effects)}: start from other values, or leave an effect out"
        )
    return found


def finish_search(data: FitData, search: Search, outcome: Outcome) -> Fit:
    """Where a search has come to.

    Args:
        data: the records that it was made by.
        search: that has ended, or that nobody goes on with.
        outcome: how it ended.
    """
    free = (*search.search.linear, *search.search.nonlinear)
    if outcome is Outcome.DIVERGED:
        return _diverged(search.point, free)
    nonlinear = derivatives(data, search.search, search.point.values, search.search.nonlinear)
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


@dataclass(frozen=True, slots=True, eq=False)
class WeightedFit:
    """A fit whose records weigh by what it leaves over of them."""

    fit: Fit
    data: FitData
    inflation: float
    """At least 1: by how much wider than the fit has them variances are, since what a model lacks is no white noise."""


def weighted_fit(observations: Sequence[Observation], model: Isolator) -> WeightedFit:
    """Fitted by the noise, weighed anew by what that leaves over, and fitted again.

    Args:
        observations: the records.
        model: effects, and values to start from.

    Raises:
        RecordError: there is nothing to fit to.
        ModelError: the model's force grows beyond all bounds.
    """
    if not observations:
        raise RecordError("no earthquake is left to fit to; one that is not held out, with force and motion, would do")
    by_noise = FitData.by_noise(sorted(observations, key=lambda one: one.start))
    first = finite_fit(by_noise, model)
    data = reweighted_data(by_noise, first)
    fit = finite_fit(data, first.model)
    data.memory.clear()
    return WeightedFit(fit, data, inflation(data, fit))


def rms_by_record(data: FitData, fit: Fit) -> Vector:
    """(records,) N, root mean square of what a fit to the data leaves over within the band."""
    spans = zip(data.spans, data.whitenings, strict=True)
    return np.array([np.linalg.norm(fit.residual[span] * w.std) / np.sqrt(w.count) for span, w in spans])


def error(data: FitData, fit: Fit) -> float:
    """N, the same over all records."""
    return pooled_rms(rms_by_record(data, fit), np.array([w.count for w in data.whitenings]))


def reweighted_data(by_noise: FitData, fit: Fit) -> FitData:
    """The same records, weighed by what a fit to them leaves over where that is more than noise."""
    residuals = [fit.residual[span] for span in by_noise.spans]
    return by_noise.weighed(reweighted(by_noise.whitenings, residuals))


def inflation(data: FitData, fit: Fit) -> float:
    """The residual's mean power where the force lies, over that everywhere; 1 for noise."""
    each = []
    for span in data.spans:
        power, force = fit.residual[span] ** 2, data.target[span] ** 2
        each.append(np.sum(power * force) / (np.sum(force) * np.mean(power)))
    return max(1.0, float(np.mean(each)))
