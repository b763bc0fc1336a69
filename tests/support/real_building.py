"""The real building's force: exact, from all its levels, and from any of them as the product would see it."""

from functools import cache
from itertools import combinations

import numpy as np
from building_models import bncs, bncs_segments

from core.analysis import AnalysisSettings
from core.arrays import Vector
from core.comparison.misfit import fitting_rate
from core.estimators.superstructure import InstrumentedSuperstructure, instrumented_superstructure
from core.record import Record
from core.sensors.preparation import prepared

TESTS = ("CNP100", "LAC100", "SP100")
BAND = (0.1, 25.0)
"""Hz, of the truth and of what the estimators are given."""
BASE, FLOORS = "base slab", ("2", "3", "4", "5", "roof")
SUBSETS = tuple(floors for count in range(1, 6) for floors in combinations(FLOORS, count))
"""Every choice of floors that are measured besides the base slab."""
GOALS = {("4", "roof"): (99.3, 99.1, 98.5), ("roof",): (97.0, 97.0, 97.0)}
"""%, fit in each of TESTS, by the floors that are measured."""


@cache
def superstructure(test: str, floors: tuple[str, ...]) -> InstrumentedSuperstructure:
    """Input of an estimator from the product's chain: screened, at 100 Hz, without baseline, within BAND."""
    return instrumented_superstructure(_record(test), bncs(), "x", (BASE, *floors), BAND)


@cache
def inertia(test: str) -> Vector:
    """(n,) N, −Σ m_i a_i over all six levels, within BAND."""
    every = superstructure(test, FLOORS)
    force: Vector = -every.base_mass * every.base_acceleration - every.floor_mass @ every.floor_acceleration
    return force


def best_instantaneous(test: str, floors: tuple[str, ...]) -> float:
    """%, fit of the best fixed weights of the measured channels, learnt from the exact force of the very test."""
    seen = superstructure(test, floors)
    channels = np.vstack([seen.base_acceleration, seen.floor_acceleration]).T
    weights = np.linalg.lstsq(channels, inertia(test), rcond=None)[0]
    return fitting_rate(inertia(test), channels @ weights)


@cache
def _record(test: str) -> Record:
    record = prepared(bncs_segments(test), bncs(), AnalysisSettings().rate).record
    if record is None:
        raise ValueError(f"{test} cannot be used")
    return record
