"""Structure in a model's residual, whatever its cause.

A linear regression of the residual on what a layer's force may depend on: motion and its powers, hysteretic variables
of several lengths, the largest past displacement, travel, lags, the other direction, vertical load, temperature.
Effects of the model's own parameters are projected out of both, and known patterns of the force's error count as little
as in a fit. The regression is judged on blocks of time that it was not fitted to, so that noise gives it nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.diagnosis.worth import excess
from core.fitting.data import FitData
from core.fitting.fit import Fit, tangents
from core.fitting.observation import Observation
from core.fitting.tangent import slip

STRUCTURED = 0.05
"""Share of the residual's power predicted by a regression from which on the residual has structure. Chosen on even
seeds of benchmarks.diagnosis."""
ABOVE_FLOOR = 1.25
"""Noise ratio from which on something remains to explain beside an added effect. Chosen on even seeds of
benchmarks.diagnosis."""
ABOVE_COLOURED = 2.0
"""The same where no effect takes anything: noise that is stronger at low frequencies than at the high ones, where it is
seen, looks like that, and nothing in it depends on the motion."""
BLOCK = 5.0
"""s, length of a block of the cross-validation, longer than the memory of noise in an estimated force. A choice."""
FOLDS = 5
"""Folds of the cross-validation. A choice."""
LENGTHS = (0.01, 0.04, 0.15, 0.5)
"""Lengths over which the hysteretic variables develop, as shares of the largest displacement. A choice."""
LAGS = (0.02, 0.05, 0.1)
"""s, delays of the motion among the regressors. A choice."""
RIDGE = 1e-3
"""Regularisation, as a share of a regressor's power. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Unexplained:
    """Structure that remains in the residual, and its size."""

    share: float
    """Share of the residual's power that a regression predicts; see `explained_share`."""
    noise_ratio: float
    """Noise ratio of the residual, root mean square over the records."""
    allowed: float
    """The largest of it that noise may make."""

    @property
    def is_there(self) -> bool:
        """Beyond doubt."""
        return self.noise_ratio > self.allowed or (self.share > STRUCTURED and self.noise_ratio > 1.0)

    @property
    def excess(self) -> float:
        """Power beyond the noise, over the noise's."""
        return excess(self.noise_ratio)


def unexplained(data: FitData, fit: Fit, noise_ratio: float, allowed: float) -> Unexplained:
    """Structure that a fit leaves in the residual.

    Args:
        data: the records.
        fit: of a model to them.
        noise_ratio: of the residual.
        allowed: the largest noise ratio that noise may make.
    """
    return Unexplained(explained_share(data, fit), noise_ratio, allowed)


def explained_share(data: FitData, fit: Fit) -> float:
    """Share of the residual's power that the regression predicts where it was not fitted; 0 or below for noise.

    Args:
        data: the records.
        fit: of a model to them.
    """
    raw = [
        whitening.of(np.array(list(_regressors(observation, *_largest(data)))))
        for observation, whitening in zip(data.observations, data.whitenings, strict=True)
    ]
    columns = np.concatenate(raw, axis=1)
    basis = linalg.orth(_unit(tangents(data, fit)).T)
    own = _unit(columns - (columns @ basis) @ basis.T)
    histories = [
        np.array([whitening.history(row * whitening.std) for row in [fit.residual[span], *own[:, span]]])
        / whitening.std.mean()
        for whitening, span in zip(data.whitenings, data.spans, strict=True)
    ]
    blocks = _blocks(data)
    whole = np.concatenate(histories, axis=1)
    return _predicted_share(whole[0], _unit(whole[1:]) * np.sqrt(whole.shape[1]), blocks)


def _largest(data: FitData) -> tuple[float, float]:
    layers = [observation.layer for observation in data.observations]
    return (
        max(float(np.abs(layer.displacement).max()) for layer in layers),
        max(float(np.abs(layer.velocity).max()) for layer in layers),
    )


def _regressors(observation: Observation, far: float, fast: float) -> Iterator[Vector]:
    """(n,) each."""
    given, count = observation.conditions, observation.layer.displacement.size
    u, v = observation.layer.displacement / far, observation.layer.velocity / fast
    largest, travel = np.maximum.accumulate(np.abs(u)), np.cumsum(np.abs(v)) / count
    across, load, warm = given.u_cross / far, given.axial_load - 1, (given.temperature - 20) / 10
    yield from (u, v, u * np.abs(u), u**3, u**5, v * np.abs(v), np.sign(v) * np.sqrt(np.abs(v)), u**2, v * np.abs(u))
    yield from (v * u**2, u * largest, u * travel, u * load, u * warm, u * np.abs(across), given.v_cross / fast)
    for length in LENGTHS:
        z = slip(u, length)[0] / length
        yield from (z, z * np.abs(u), z * largest, z * travel, z * load, z * warm, z * np.abs(across), z * np.abs(v))
    for lag in LAGS:
        late = round(lag * observation.rate)
        yield from (delayed(u, late), delayed(v, late))


def delayed(series: Vector, samples: int) -> Vector:
    """(n,) the series so many samples later; its first value before that."""
    return np.concatenate([np.full(samples, series[0]), series])[: series.size]


def _unit(rows: Matrix) -> Matrix:
    size = np.linalg.norm(rows, axis=1)
    kept = size > 1e-9 * max(size.max(initial=0.0), 1e-300)
    return np.asarray(rows[kept] / size[kept, None])


def _blocks(data: FitData) -> Vector:
    """(n,) which fold each sample belongs to, of all records one after the other."""
    each, before = [], 0
    for whitening in data.whitenings:
        block = (np.arange(whitening.count) / whitening.rate // BLOCK).astype(int)
        each.append(before + block)
        before += int(block[-1]) + 1
    return np.concatenate(each) % FOLDS


def _predicted_share(residual: Vector, rows: Matrix, folds: Vector) -> float:
    left = 0.0
    for fold in range(FOLDS):
        seen = folds != fold
        gram = rows[:, seen] @ rows[:, seen].T
        penalty = RIDGE * seen.sum() * np.eye(len(rows))
        weights = linalg.solve(gram + penalty, rows[:, seen] @ residual[seen], assume_a="pos")
        left += float(np.sum((residual[~seen] - weights @ rows[:, ~seen]) ** 2))
    return 1 - left / float(residual @ residual)
