"""Every estimator with a goal reaches it: a part of what `python -m benchmarks.restoring_force` runs."""

from functools import cache

import numpy as np
import pytest
from accuracy import COVERED, GOALS, NOISES, Agreement, agreement
from describing import errors_of_records
from real_building import GOALS as REAL_GOALS
from real_building import SUBSETS, TESTS, inertia, superstructure
from shared import needs_shared
from truths import KINDS, MOTIONS, instrumented, recorded, truth

from core.analysis import AnalysisSettings
from core.estimators import ESTIMATORS

LIKE = "in class"
STATIC = "cms"
OUTSIDE = [kind for kind in KINDS if kind != LIKE]
judged = pytest.mark.parametrize("estimator", [name for name in ESTIMATORS if name in GOALS])
other_than_static = pytest.mark.parametrize("estimator", [name for name in ESTIMATORS if name != STATIC])


@cache
def found(estimator: str, kind: str, motion: str, noise: float, seed: int = 0) -> Agreement:
    channels = recorded(KINDS[kind], motion, noise, seed)
    force = truth(KINDS[kind], motion, seed % KINDS[kind].draws).force
    return agreement(force, ESTIMATORS[estimator](instrumented(channels)))


@judged
@pytest.mark.parametrize("motion", MOTIONS)
def test_fit_where_the_model_holds(estimator: str, motion: str) -> None:
    fits = np.array([found(estimator, LIKE, motion, noise).fit for noise in NOISES])
    assert (fits >= GOALS[estimator].in_class).all(), fits


@judged
@pytest.mark.slow
@pytest.mark.parametrize("kind", OUTSIDE)
def test_fit_where_the_model_does_not_hold(estimator: str, kind: str) -> None:
    """Kobe, whose high frequencies make it the hardest of the motions."""
    fits = np.array([found(estimator, kind, "Kobe", noise).fit for noise in (NOISES[0], NOISES[-1])])
    assert (fits >= GOALS[estimator].outside).all(), fits


@judged
@pytest.mark.parametrize("noise", NOISES)
def test_the_band_covers_the_force(estimator: str, noise: float) -> None:
    """In the mean of the motions, over their whole records."""
    share = np.mean([found(estimator, LIKE, motion, noise).coverage for motion in MOTIONS])
    assert COVERED[0] <= share <= COVERED[1]


@other_than_static
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_never_worse_than_static_interpolation(estimator: str, kind: str) -> None:
    for noise in (NOISES[0], NOISES[-1]):
        assert found(estimator, kind, "Kobe", noise).fit >= found(STATIC, kind, "Kobe", noise).fit


@judged
@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "bias", "scatter"), [(0.01, (0.01, 0.05), (0.02, 0.10)), (0.10, (0.01, 0.05), (0.035, 0.22))]
)
def test_equivalent_stiffness_and_damping(
    estimator: str, noise: float, bias: tuple[float, float], scatter: tuple[float, float]
) -> None:
    error = errors_of_records(noise, AnalysisSettings(estimator=estimator))[:, 0]
    assert (np.abs(error.mean(axis=0)) <= bias).all()
    assert (error.std(axis=0) <= scatter).all()


@needs_shared
@judged
@pytest.mark.parametrize("floors", REAL_GOALS, ids="+".join)
def test_fit_on_the_real_building(estimator: str, floors: tuple[str, ...]) -> None:
    fits = [on_the_real_building(estimator, test, floors).fit for test in TESTS]
    assert (np.array(fits) > REAL_GOALS[floors]).all(), fits


@needs_shared
@other_than_static
@pytest.mark.slow
@pytest.mark.parametrize("test", TESTS)
def test_never_worse_than_static_interpolation_on_the_real_building(estimator: str, test: str) -> None:
    for floors in SUBSETS:
        static = on_the_real_building(STATIC, test, floors).fit
        assert on_the_real_building(estimator, test, floors).fit >= static, floors


@cache
def on_the_real_building(estimator: str, test: str, floors: tuple[str, ...]) -> Agreement:
    return agreement(inertia(test), ESTIMATORS[estimator](superstructure(test, floors)))
