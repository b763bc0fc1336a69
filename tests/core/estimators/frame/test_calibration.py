from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from exact_spectra import DESIGN, PAPER, exact_lines, known_superstructure, unrelated_lines, with_noise, with_rocking
from hypothesis import given, settings, strategies as st

from core.arrays import Vector
from core.building import fixed_base_modes
from core.estimators.frame.calibration import best_start, calibrated
from core.estimators.frame.evaluation import Hypothesis, Problem
from core.estimators.frame.hypotheses import as_given, corrected, with_unmodelled_motion
from core.estimators.frame.model import Design, superstructure
from core.paper import BUILDING

LAYOUT = DESIGN.layout
AMPLITUDE = 3.0
"""m/s² kg^½, of free vibrations."""
STEP = 1e-5
"""Step of the differences."""

HYPOTHESES = (as_given, corrected, with_unmodelled_motion)
Making = Callable[[Design, float], Hypothesis]


@pytest.mark.parametrize("noise", [1e-6, 1e-4, 1e-2])
def test_the_papers_building_is_recovered(noise: float) -> None:
    """Exact as the noise vanishes, from two floors: Table 1's building.

    Relative to the noise, frequencies are right to 0.02 and damping ratios to 2 in these 60 s; rocking, soft joints and
    further damping are none as far as their logarithms go, which without noise never settle. The way leads
    through ever less noise, for with little the cost has many valleys.
    """
    rng = np.random.default_rng(2)
    lines = with_noise(exact_lines(PAPER, rng), noise, rng)
    problem = Problem(lines, DESIGN, as_given(DESIGN, 0.0))
    start = best_start(problem)
    for more in (level / noise for level in (1e-2, 1e-3, 1e-4, 1e-5) if level > noise):
        noisier = replace(lines, noise=more**2 * lines.noise)
        start = calibrated(replace(problem, lines=noisier), start).parameters
    calibration = calibrated(problem, start)
    true = fixed_base_modes(BUILDING)
    rounding = 1e-6
    assert calibration.structure.frequencies[:4] == pytest.approx(true.frequency[:4], rel=0.05 * noise + rounding)
    assert calibration.structure.damping_ratios[:4] == pytest.approx(
        true.damping_ratio[:4], rel=5 * noise + 5 * rounding
    )
    assert calibration.structure.lateral.storey_stiffness == pytest.approx(
        BUILDING.storey_stiffness, rel=noise + 5 * rounding
    )


def first_modes(parameters: Vector) -> Vector:
    """(6,) logarithms of the first three frequencies and damping ratios."""
    structure = superstructure(parameters, DESIGN)
    return np.log(np.concatenate([structure.frequencies[:3], structure.damping_ratios[:3]]))


def test_covariance_is_that_of_the_error() -> None:
    """Truths drawn from the prior, so that the prior is right too (Cook, Gelman and Rubin 2006).

    Squared errors of three frequencies and damping ratios over their variance: of 24 draws the mean has a standard
    error of 0.12 were they independent, 0.29 were all six of a draw one.
    """
    hypothesis, ratios = as_given(DESIGN, 0.0), []
    for seed in range(24):
        rng = np.random.default_rng([3, seed])
        true = hypothesis.mean + hypothesis.std * rng.standard_normal(LAYOUT.size)
        true[LAYOUT.scale] = 2 * np.log(rng.uniform(0.8, 2.0))  # its prior says nothing
        lines = with_noise(exact_lines(known_superstructure(true, DESIGN), rng), 0.05, rng).every(2)
        calibration = calibrated(Problem(lines, DESIGN, hypothesis), true)
        moves = STEP * np.eye(LAYOUT.size)
        here = first_modes(calibration.parameters)
        gradient = np.array([(first_modes(calibration.parameters + move) - here) / STEP for move in moves]).T
        ratios.append((here - first_modes(true)) ** 2 / np.diag(gradient @ calibration.covariance @ gradient.T))
    assert np.mean(ratios) == pytest.approx(1.0, abs=3 * 0.2)
    assert np.median(ratios) == pytest.approx(0.45, abs=0.25)  # of chi-square with one degree of freedom


def test_chi_square_is_one_where_noise_explains_the_rest() -> None:
    """Within four of its standard deviations, √(1 / degrees of freedom)."""
    rng = np.random.default_rng(4)
    lines, hypothesis = with_noise(exact_lines(PAPER, rng), 0.05, rng), as_given(DESIGN, 0.0)
    problem = Problem(lines, DESIGN, hypothesis)
    calibration = calibrated(problem, best_start(problem))
    assert calibration.degrees_of_freedom == 2 * lines.angular.size
    assert calibration.chi_square == pytest.approx(1.0, abs=4 / np.sqrt(calibration.degrees_of_freedom))
    assert np.diag(calibration.covariance)[hypothesis.std == 0] == pytest.approx(0.0)


def test_rocking_of_its_own_is_reported_by_band() -> None:
    """Its variance, where it is above the noise: within four standard errors of a variance from a band's lines."""
    rng, share = np.random.default_rng(5), 0.2
    true = with_unmodelled_motion(DESIGN, 0.0).mean
    true[LAYOUT.scale] = 2 * np.log(1.2)
    known = known_superstructure(true, DESIGN)
    lines = with_noise(with_rocking(exact_lines(known, rng), known, share, rng), 1e-3, rng)
    hypothesis = with_unmodelled_motion(DESIGN, 0.0)
    problem = Problem(lines, DESIGN, hypothesis)
    calibration = calibrated(problem, best_start(problem))
    count = np.bincount(lines.band)
    assert calibration.variances.rocking == pytest.approx(share**2, rel=4 / np.sqrt(count.min()))
    assert calibration.variances.floors.max() < 0.1 * share**2


@pytest.mark.parametrize("frequency", [0.5, 1.1, 3.0, 7.0])
def test_the_start_is_near_the_first_frequency(frequency: float) -> None:
    """Within a step of those that are tried, 14 %."""
    rng, hypothesis = np.random.default_rng(6), as_given(DESIGN, 0.0)
    true = hypothesis.mean.copy()
    true[LAYOUT.scale] = 2 * np.log(frequency)
    lines = with_noise(exact_lines(known_superstructure(true, DESIGN), rng), 0.05, rng)
    start = best_start(Problem(lines, DESIGN, hypothesis))
    assert np.exp(start[LAYOUT.scale] / 2) == pytest.approx(frequency, rel=0.14)


@pytest.mark.parametrize("making", HYPOTHESES)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), at_rest=st.booleans())
def test_a_record_of_no_superstructure_raises_nothing(making: Making, seed: int, at_rest: bool) -> None:
    """Not settling is a value."""
    lines = unrelated_lines(np.random.default_rng(seed), at_rest=at_rest).every(3)
    hypothesis = making(DESIGN, 0.0 if at_rest else AMPLITUDE)
    problem = Problem(lines, DESIGN, hypothesis)
    calibration = calibrated(problem, best_start(problem))
    assert calibration.has_settled in (True, False)
    assert np.isfinite(calibration.parameters).all()
    assert (np.diag(calibration.covariance)[hypothesis.free] > 0).all()
