"""The spectrum of an estimate's error has the error's variance, and lies where the error lies."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st

from core.estimators.frame.evaluation import Hypothesis
from core.estimators.frame.hypotheses import as_given, corrected, with_unmodelled_motion
from core.estimators.frame.model import Design
from core.estimators.result import (
    EXPLAINED,
    Assessment,
    StoreyStiffness,
    assessment_findings,
    fused_displacement_error,
    white,
)
from core.isolation_layer.fusion import fuse
from core.paper import BUILDING

RATE, COUNT = 100.0, 18000


def test_a_white_error_has_its_variance_within_the_band() -> None:
    error = white(np.full(10, 3.0), (0.2, 10.2))
    frequency = np.linspace(0.2, 10.2, 50)
    assert np.trapezoid(error.at(frequency), frequency) == pytest.approx(9.0)


@pytest.mark.parametrize(("transducer", "accelerometer"), [(1e-5, 1e-3), (1e-4, 1e-3), (1e-5, 1e-2)])
def test_a_fused_displacement_errs_where_it_is_reported_to(transducer: float, accelerometer: float) -> None:
    """Four standard errors of a periodogram's mean over an octave: half of its lines are free under the window."""
    rng, time = np.random.default_rng(1), np.arange(COUNT) / RATE
    ω = 2 * np.pi * 0.4
    exact = 0.05 * np.sin(ω * time) * np.sin(np.pi * time / time[-1]) ** 2
    acceleration = np.gradient(np.gradient(exact, time), time)
    motion = fuse(
        exact + transducer * rng.standard_normal(COUNT),
        acceleration + accelerometer * rng.standard_normal(COUNT),
        RATE,
        displacement_noise=transducer,
        acceleration_noise=accelerometer,
    )
    printed = fused_displacement_error(float(np.median(motion.displacement_std)), float(np.median(motion.velocity_std)))
    power = np.abs(np.fft.rfft((motion.displacement - exact) * np.hanning(COUNT))) ** 2
    frequency = np.fft.rfftfreq(COUNT, 1 / RATE)
    density = 2 * power / RATE / np.sum(np.hanning(COUNT) ** 2)
    for low in (0.2, 0.4, 0.8, 1.6):
        there = (frequency >= low) & (frequency < 2 * low)
        ratio = np.mean(density[there]) / np.mean(printed.at(frequency[there]))
        assert ratio == pytest.approx(1.0, abs=4 / np.sqrt(there.sum() / 2))


DESIGN = Design.of(BUILDING.floor_mass, None, np.array([2, 6]))
EXPLAINS = Assessment("masses and sensors as given", 1.05, is_at_rest=True, prior_share=0.1)


@pytest.mark.parametrize("making", [as_given, corrected, with_unmodelled_motion])
def test_what_was_assumed_is_stated_once_in_a_whole_sentence(making: Callable[[Design, float], Hypothesis]) -> None:
    assumption = making(DESIGN, 0.0).name
    (result,) = assessment_findings(replace(EXPLAINS, assumption=assumption, chi_square=3.21), "x")
    words = result.message.split()
    assert (result.severity, result.value) == ("note", 3.21)
    assert f"(chi-square 3.21); assumed: {assumption}; measured floors stay as measured" in result.message
    assert all(one != other for one, other in pairwise(words))


def test_nothing_is_stated_where_assumptions_hold_or_none_was_needed() -> None:
    for holds in (EXPLAINS, replace(EXPLAINS, chi_square=EXPLAINED), replace(EXPLAINS, chi_square=None)):
        assert assessment_findings(holds, "x") == ()
    assert assessment_findings(None, "x") == ()


def test_a_fallback_is_a_warning_with_its_reason() -> None:
    (result,) = assessment_findings(replace(EXPLAINS, fallback="left-out floors are predicted badly"), "y")
    assert result.severity == "warning"
    assert result.message.startswith(
        "direction y: the calibrated superstructure was not used: left-out floors are predicted"
    )


@given(st.integers(1, 8), st.integers(0, 1000), st.floats(0.05, 10.0))
def test_information_is_what_the_record_adds(floors: int, seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((floors, floors + 3)) / 0.05
    added = rows @ rows.T
    prior_covariance = spread**2 * (np.eye(floors) + 0.5)
    covariance = np.linalg.inv(added + np.linalg.inv(prior_covariance))
    result = StoreyStiffness(np.zeros(floors), covariance, prior_covariance).information
    assert result == pytest.approx(added, rel=1e-6, abs=1e-8 * np.abs(added).max())


def test_a_record_without_information_on_a_storey_adds_nothing() -> None:
    prior_covariance = np.diag([0.09, 0.04])
    known = StoreyStiffness(np.zeros(2), np.diag([0.0001, 0.04]), prior_covariance).information
    assert known == pytest.approx(np.diag([1e4 - 1 / 0.09, 0.0]), abs=1e-9)
