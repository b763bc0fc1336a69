"""Errors of k_eq and c_eq against the paper's isolation layer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from describing_function import record_errors, robust_spread

from benchmarks.force_tables import shown
from benchmarks.table import Table
from core.analysis import AnalysisSettings

GOALS = {0.01: (1.0, 2.0, 5.0, 10.0), 0.10: (1.0, 3.5, 5.0, 22.0)}
"""%, by noise: bias and scatter of k_eq, bias and scatter of c_eq."""
ABOUT = """\
The whole analysis, with fused displacement, of 18 records: three motions, 3.5 to 280 gal, two draws of the noise on
every channel. Errors in %, relative to the describing function of the true law, of the cycles of at least a tenth of
the event's largest displacement. Bias is the mean, scatter the standard deviation including all outliers, robust 1.4826
times the median absolute deviation. Covered: share of cycles, in %, within 1.96 of their own standard deviations."""


@dataclass(frozen=True, slots=True)
class CycleErrors:
    """Errors of all cycles with the force of one estimator, %, of k_eq and of c_eq."""

    estimator: str
    noise: float
    count: int
    bias: tuple[float, float]
    scatter: tuple[float, float]
    robust: tuple[float, float]
    covered: tuple[float, float]


def cycle_errors(estimator: str, noise: float) -> CycleErrors:
    """Statistics of `record_errors`."""
    error, std = np.moveaxis(record_errors(noise, AnalysisSettings(estimator=estimator)), 1, 0)
    covered = np.mean(np.abs(error) < 1.96 * std, axis=0)
    figures = [error.mean(axis=0), error.std(axis=0), robust_spread(error), covered]
    return CycleErrors(estimator, noise, len(error), *((100 * float(k), 100 * float(c)) for k, c in figures))


def table(found: Sequence[CycleErrors]) -> Table:
    """A row for every estimator and noise, and for the goals."""
    rows = [("", f"goal, {100 * n:g} %", "", *_columns(tuple(f"{g:g}" for g in goal))) for n, goal in GOALS.items()]
    for one in found:
        figures = (one.bias[0], one.scatter[0], one.bias[1], one.scatter[1])
        marked = [shown(f, abs(f) <= g, 1) for f, g in zip(figures, GOALS[one.noise], strict=True)]
        beside = [
            f"{value:.{digits}f}" for value, digits in zip((*one.robust, *one.covered), (2, 1, 0, 0), strict=True)
        ]
        rows.append((one.estimator, f"{100 * one.noise:g} %", str(one.count), *_columns(marked, beside)))
    head = _columns(("bias", "scatter", "bias", "scatter"), ("robust", "robust", "covered", "covered"))
    named = [f"{'k_eq' if i < len(head) / 2 else 'c_eq'} {what}" for i, what in enumerate(head)]
    return Table("k_eq and c_eq by cycle", ABOUT, ("estimator", "noise", "cycles", *named), tuple(rows))


def _columns(figures: Sequence[str], beside: Sequence[str] = ("", "", "", "")) -> tuple[str, ...]:
    """Bias, scatter, robust scatter and coverage, of k_eq and then of c_eq."""
    return (*figures[:2], beside[0], beside[2], *figures[2:], beside[1], beside[3])
