"""Accuracy of every estimator against an exact force, and the goals."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import process_time
from types import MappingProxyType

import numpy as np
from exact_responses import BAND, KINDS, as_prepared, estimator_input, exact_response, recorded
from ground_motions import RATE

from core.arrays import Matrix, Vector
from core.comparison.misfit import fitting_rate
from core.estimators import ESTIMATORS, Estimator
from core.estimators.result import RestoringForce

NOISES = (0.01, 0.05, 0.10)
"""Standard deviation of the sensors' white noise over the root mean square of their channel."""
STANDARD_DEVIATIONS = 1.96
"""On either side of the estimate: 95 % of a normal distribution."""
STRONG = (0.05, 0.95)
"""Fractions of the force's energy between which the motion is strong."""
COVERED = (0.93, 0.97)
"""Goal: share of the samples within the 95 % band."""


@dataclass(frozen=True, slots=True)
class Goal:
    """Goal of an estimator for the paper's building, for the worst motion and the worst seed."""

    in_class: tuple[float, float, float]
    """%, fit at NOISES."""
    outside: float
    """%, fit at each of NOISES for every truth outside the model class and every cut record."""


GOALS: Mapping[str, Goal] = MappingProxyType({"smoother": Goal((99.7, 99.1, 98.3), 98.0)})
"""By estimator; the paper's own is what others are measured against."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """An estimate beside the exact force."""

    fit: float
    """%, the paper's fitting rate over the whole record."""
    coverage: float
    """Share of all samples at which the 95 % band holds the exact force."""
    strong_coverage: float
    """The same in strong motion."""


@dataclass(frozen=True, slots=True)
class Score:
    """One estimator on one record."""

    estimator: str
    kind: str
    motion: str
    noise: float
    seed: int
    measured: Agreement
    """From the channels as they were measured."""
    filtered: Agreement | None
    """From what the product makes of them, against the force within the same band; None of a record too short for it,
    and but for the first seed: a filter does to one what it does to another.
    """
    seconds: float
    """CPU time of one estimate."""


def scores(kind: str, motion: str, noises: Sequence[float], seeds: Sequence[int]) -> Iterator[Score]:
    """Scores of every estimator, noise and seed."""
    for noise in noises:
        for seed in seeds:
            channels = recorded(KINDS[kind], motion, noise, seed)
            force = exact_response(KINDS[kind], motion, seed % KINDS[kind].draws).force
            for name, estimator in ESTIMATORS.items():
                began = process_time()
                found = estimator(estimator_input(channels))
                seconds = process_time() - began
                filtered = _filtered(estimator, channels, force) if seed == seeds[0] else None
                yield Score(name, kind, motion, noise, seed, agreement(force, found), filtered, seconds)


def agreement(force: Vector, found: RestoringForce) -> Agreement:
    """Agreement of an estimate with the exact force, (n,) N."""
    covered = np.abs(found.force - force) <= STANDARD_DEVIATIONS * found.std
    passed = np.cumsum(force**2)
    start, end = np.searchsorted(passed, np.array(STRONG) * passed[-1])
    return Agreement(fitting_rate(force, found.force), float(covered.mean()), float(covered[start:end].mean()))


def long_enough(samples: Vector) -> bool:
    """True if the product filters a record of this length: two periods of the lowest frequency."""
    return samples.size > 2 * RATE / BAND[0]


def _filtered(estimator: Estimator, channels: Matrix, force: Vector) -> Agreement | None:
    if not long_enough(force):
        return None
    return agreement(as_prepared(force), estimator(estimator_input(as_prepared(channels))))
