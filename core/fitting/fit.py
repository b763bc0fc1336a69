"""Fits of a model to records, with covariances, and the weights of records that a model explains incompletely."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import ModelError, RecordError
from core.fitting.data import FitData, compute_columns
from core.fitting.noise import pooled_rms
from core.fitting.observation import Observation
from core.fitting.projection import (
    FreeParameters,
    Point,
    coefficients,
    derivatives,
    diverges,
    free_parameters,
    model_of,
    projected,
    values_of,
    wanted_columns,
)
from core.fitting.search import Outcome, Search, start_search, step_search
from core.model.isolator import Isolator, Key, parameter
from core.optimisation import DEGENERATE
from core.signals.whitening import reweighted


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A model at its fitted values."""

    model: Isolator
    free: tuple[Key, ...]
    """Parameters that were fitted: those that the force is proportional to, then the others."""
    covariance: Matrix
    """(free, free) covariance of their values in SI units, by the noise that weights the data."""
    chi_square: float
    """Sum of squares of the residual; infinite if the fit diverged."""
    residual: Vector
    """(m,) whitened, measured less modelled."""
    outcome: Outcome
    undetermined: tuple[Key, ...]
    """Parameters that the records do not determine: other parameters have the same effect on the force."""

    @property
    def std(self) -> Mapping[Key, float]:
        """Standard deviation of every fitted value."""
        return dict(zip(self.free, np.sqrt(np.diag(self.covariance)), strict=True))


def tangents(data: FitData, fit: Fit) -> Matrix:
    """(free, m) derivatives of the whitened force by every fitted parameter."""
    return derivatives(data, free_parameters(fit.model), values_of(fit.model), fit.free)


def signatures(data: FitData, base: Fit, models: Sequence[Isolator]) -> list[Matrix]:
    """(k, m) changes of the whitened force by the effects that each model adds to its base, at their values in it.

    One row for each of their linear parameters, or one row in all if they have none, as effects that scale others.
    """
    changes = [_change(base, model) for model in models]
    compute_columns(data, (one for change in changes for part in change for one in wanted_columns(*part)))
    rows = [_changed(data, *change) for change in changes]
    ends = np.cumsum([len(one) for one in rows])[:-1]
    return np.split(data.whitened(np.concatenate(rows)), ends)


Part = tuple[FreeParameters, Mapping[Key, float], tuple[Key, ...]]
"""Arguments of `coefficients`."""


def _change(base: Fit, model: Isolator) -> tuple[Part, ...]:
    """By the model's own linear parameters, if it has any; else by those of the groups that it changes, with what it
    adds and without."""
    search, values = free_parameters(model), values_of(model)
    own = tuple(key for key in search.linear if key[0] not in base.model.effects)
    if own:
        return ((search, values, own),)
    changed = {name for group in search.groups if set(group) - set(base.model.effects) for name in group}
    return tuple(
        (one, values, tuple(key for key in one.linear if key[0] in changed))
        for one in (search, free_parameters(base.model))
    )


def _changed(data: FitData, change: Part, without: Part | None = None) -> Matrix:
    """(k, m) N."""
    if without is None:
        return coefficients(data, *change)
    with_it, alone = (
        np.array([values[key] for key in linear]) @ coefficients(data, search, values, linear)
        for search, values, linear in (change, without)
    )
    return np.asarray(with_it - alone)[None]


def residual_at(data: FitData, model: Isolator) -> Vector:
    """(m,) whitened residual at the model's own values."""
    search, values = free_parameters(model), values_of(model)
    amplitudes = np.array([values[key] for key in search.linear])
    return np.asarray(data.target - amplitudes @ derivatives(data, search, values, search.linear))


def chi_square(data: FitData, model: Isolator) -> float:
    """Sum of squares of the whitened residual at the model's own values."""
    return float(np.sum(residual_at(data, model) ** 2))


def at_values(data: FitData, model: Isolator) -> Fit:
    """Fit of the linear parameters alone; the nonlinear ones keep their values and count as known."""
    search = free_parameters(model)
    outcome = Outcome.STOPPED if search.nonlinear else Outcome.SETTLED
    point = projected(data, search, values_of(model))
    return _result(point, search.linear, point.linear, outcome)


def fitted(data: FitData, model: Isolator, zero: Collection[Key] = ()) -> Fit:
    """Fit of all parameters except those that a fit leaves alone.

    Args:
        data: the records.
        model: effects, and values to start from.
        zero: parameters that the force is proportional to, and that are and stay 0.
    """
    search = start_search(data, model, zero)
    while search.outcome is None:
        search = step_search(data, search)
    return finish_search(data, search, search.outcome)


def finite_fit(data: FitData, model: Isolator, zero: Collection[Key] = ()) -> Fit:
    """As `fitted`, with an error instead of a fit that diverged.

    Raises:
        ModelError: the model's force, or its derivatives, diverged.
    """
    fit = fitted(data, model, zero)
    if fit.outcome is Outcome.DIVERGED:
        raise ModelError(
            f"{fit.outcome.value}, with {', '.join(model.effects)}: start from other values, or leave an effect out"
        )
    return fit


def finish_search(data: FitData, search: Search, outcome: Outcome) -> Fit:
    """Fit at the point that a search has reached.

    Args:
        data: the records of the search.
        search: complete, or abandoned.
        outcome: of the search; STOPPED if it was abandoned.
    """
    free = (*search.search.linear, *search.search.nonlinear)
    if outcome is Outcome.DIVERGED:
        return _diverged(search.point, free)
    nonlinear = derivatives(data, search.search, search.point.values, search.search.nonlinear)
    return _result(search.point, free, np.concatenate([search.point.linear, nonlinear]), outcome)


def _result(point: Point, free: tuple[Key, ...], turned: Matrix, outcome: Outcome) -> Fit:
    """Fit at a point, from (free, m) derivatives of the whitened force."""
    if not np.isfinite(point.cost) or diverges(turned):
        return _diverged(point, free)
    scale = np.linalg.norm(turned, axis=1)
    there = np.flatnonzero(scale > 0)
    normal = turned[there] @ turned[there].T / np.outer(scale[there], scale[there])
    values, vectors = linalg.eigh(normal)
    spread = vectors / np.sqrt(np.maximum(values, DEGENERATE * values.max(initial=0.0)))
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
    """Fit with an infinite misfit and an unknown covariance."""
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
    """A fit whose data are weighted by its own residual where that exceeds the noise."""

    fit: Fit
    data: FitData
    inflation: float
    """Factor, at least 1, by which variances exceed those of the fit, since the residual is not white."""


def weighted_fit(observations: Sequence[Observation], model: Isolator, zero: Collection[Key] = ()) -> WeightedFit:
    """Fit with the noise as weight, and again with the residual of that fit as weight.

    Args:
        observations: the records.
        model: effects, and values to start from.
        zero: parameters that the force is proportional to, and that are and stay 0.

    Raises:
        RecordError: there are no observations, or the layer does not move in any.
        ModelError: the model's force diverged.
    """
    check_motion(observations)
    weighted = reweighted_fit(FitData.by_noise(sorted(observations, key=lambda one: one.start)), model, zero)
    weighted.data.memory.clear()
    return weighted


def check_motion(observations: Sequence[Observation]) -> None:
    """Raise RecordError if there is no record, or the layer does not move, or has no force, in any of them."""
    if not observations:
        raise RecordError("no earthquake is left to fit to; add one that is not held out and has force and motion")
    layers = [one.layer for one in observations]
    if not any(np.ptp(layer.displacement) and layer.force.any() for layer in layers):
        raise RecordError(
            "the isolation layer does not move, or has no force, in any of these earthquakes; "
            "add one with motion, and check the sensors of ground and base"
        )


def reweighted_fit(by_noise: FitData, model: Isolator, zero: Collection[Key] = ()) -> WeightedFit:
    """As `weighted_fit`, of records that are weighed by their noise; their cache of columns stays."""
    first = finite_fit(by_noise, model, zero)
    data = reweighted_data(by_noise, first)
    fit = finite_fit(data, first.model, zero)
    return WeightedFit(fit, data, inflation(data, fit))


def rms_by_record(data: FitData, residual: Vector) -> Vector:
    """(records,) N, root mean square of an (m,) whitened residual within the band."""
    return np.array([w.rms(residual[span]) for span, w in zip(data.spans, data.whitenings, strict=True)])


def error(data: FitData, fit: Fit) -> float:
    """N, root mean square of the residual over all records."""
    return pooled_rms(rms_by_record(data, fit.residual), np.array([w.count for w in data.whitenings]))


def reweighted_data(by_noise: FitData, fit: Fit) -> FitData:
    """The same records, weighted by the residual of a fit where it exceeds the noise."""
    residuals = [fit.residual[span] for span in by_noise.spans]
    return by_noise.weighed(reweighted(by_noise.whitenings, residuals))


def inflation(data: FitData, fit: Fit) -> float:
    """Mean power of the residual weighted by the force's power, over its plain mean; 1 for white noise."""
    each = []
    for span in data.spans:
        power, force = fit.residual[span] ** 2, data.target[span] ** 2
        if force.any() and power.any():  # a record at rest weighs nothing
            each.append(np.sum(power * force) / (np.sum(force) * np.mean(power)))
    return max(1.0, float(np.mean(each))) if each else 1.0
