"""A storey that is softer than its design shows in what a record says of all storeys, and as well as is said."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from truths import IN_CLASS, RATE, truth

from core.arrays import Vector
from core.estimators.estimator import InstrumentedSuperstructure
from core.estimators.frame.smoother import estimate
from core.estimators.storeys import StoreyStiffness
from core.paper import BUILDING

SOFTENED = 2
"""Storey that has lost LOST of the design's stiffness."""
LOST = 0.25


@cache
def told_stiffness() -> Vector:
    """N/m; the truth's design, with the softened storey as stiff as it was."""
    design = BUILDING.storey_stiffness.copy()
    design[SOFTENED] /= 1 - LOST
    return design


def superstructure(stiffness: Vector | None) -> InstrumentedSuperstructure:
    exact = truth(IN_CLASS, "Kobe").acceleration[[0, 3, 7]]
    noise = 0.01 * np.sqrt(np.mean(exact**2, axis=1, keepdims=True))
    channels = exact + noise * np.random.default_rng(5).standard_normal(exact.shape)
    measured = np.array([2, 6])
    return InstrumentedSuperstructure(
        RATE, channels[0], channels[1:], measured, BUILDING.base_mass, BUILDING.floor_mass, stiffness
    )


@cache
def found(scale: float) -> StoreyStiffness:
    storeys = estimate(superstructure(scale * told_stiffness())).storeys
    assert storeys is not None
    return storeys


@pytest.mark.accuracy
def test_the_softened_storey_stands_out() -> None:
    """Within four standard deviations."""
    expected = np.log(np.where(np.arange(7) == SOFTENED, 1 - LOST, 1.0))
    storeys = found(1.0)
    assert int(np.argmin(storeys.deviation)) == SOFTENED
    assert (np.abs(storeys.deviation - expected) < 4 * np.sqrt(np.diag(storeys.covariance))).all()


@pytest.mark.accuracy
def test_deviations_are_from_the_design_as_told() -> None:
    """The calibration knows the design up to a scale only."""
    assert found(1.2).deviation == pytest.approx(found(1.0).deviation - np.log(1.2), abs=1e-6)


@pytest.mark.accuracy
def test_nothing_is_said_where_nobody_gave_a_stiffness() -> None:
    assert estimate(superstructure(None)).storeys is None
    assert estimate(replace(superstructure(told_stiffness()), storey_stiffness=None)).storeys is None
