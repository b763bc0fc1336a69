"""Dependence of a missing force on variables: shares of its power that functions of each predict where not fitted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.fitting.data import FitData
from core.fitting.fit import Fit
from core.sketching.search import Library

BLOCK = 5.0
"""s, length of a block of the cross-validation, longer than the memory of noise in an estimated force. A choice."""
FOLDS = 5
"""Folds of the cross-validation. A choice."""
RIDGE = 1e-3
"""Regularisation, as a share of a regressor's power. A choice."""


@dataclass(frozen=True, slots=True)
class Dependence:
    """One variable that the missing force may depend on."""

    variable: str
    share: float
    """Share of the residual's power; 0 or below for noise."""


def dependences(data: FitData, fit: Fit, terms: Library) -> tuple[Dependence, ...]:
    """Every variable that the records vary, the one that explains most first.

    Args:
        data: the records.
        fit: of the model to them.
        terms: all terms for these records.
    """
    spans = tuple(zip(data.whitenings, data.spans, strict=True))
    residual = np.concatenate([w.back(fit.residual[span]) / w.std.mean() for w, span in spans])
    folds = _folds(data)
    found = []
    for variable, rows in _by_variable(terms).items():
        history = np.array(
            [np.concatenate([w.back(row[span]) / w.std.mean() for w, span in spans]) for row in terms.own[rows]]
        )
        size = np.sqrt(np.mean(history**2, axis=1))
        found.append(Dependence(variable, _predicted(residual, history / size[:, None], folds)))
    return tuple(sorted(found, key=lambda one: -one.share))


def _by_variable(terms: Library) -> Mapping[str, list[int]]:
    """Indices of the terms of each variable; a term of several variables belongs to the last of them."""
    rows: dict[str, list[int]] = {}
    for n, one in enumerate(terms.placed):
        rows.setdefault(one.term.depends[-1], []).append(n)
    return rows


def _folds(data: FitData) -> Vector:
    """(n,) fold of each sample, of all records one after the other."""
    each, before = [], 0
    for whitening in data.whitenings:
        block = before + (np.arange(whitening.count) / whitening.rate // BLOCK).astype(int)
        each.append(block)
        before = int(block[-1]) + 1
    return np.concatenate(each) % FOLDS


def _predicted(residual: Vector, rows: Matrix, folds: Vector) -> float:
    left = 0.0
    for fold in range(FOLDS):
        seen = folds != fold
        gram = rows[:, seen] @ rows[:, seen].T + RIDGE * seen.sum() * np.eye(len(rows))
        weights = linalg.solve(gram, rows[:, seen] @ residual[seen], assume_a="pos")
        left += float(np.sum((residual[~seen] - weights @ rows[:, ~seen]) ** 2))
    return 1 - left / float(residual @ residual)
