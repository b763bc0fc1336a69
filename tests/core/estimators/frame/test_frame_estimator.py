from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from accuracy import Agreement, agreement
from exact_responses import IN_CLASS, KINDS, RATE, estimator_input, exact_response, recorded

from core.arrays import Vector
from core.comparison.misfit import fitting_rate
from core.errors import ModelError, RecordError
from core.estimators import cms
from core.estimators.frame.estimator import NAME, estimate
from core.estimators.frame.hypotheses import as_given, corrected
from core.estimators.frame.model import Design
from core.estimators.result import RestoringForce, StoreyStiffness
from core.estimators.superstructure import InstrumentedSuperstructure
from core.paper import BUILDING
from core.signals.whitening import shrunk, whitening

SHORT = slice(2000, 5000)
"""Thirty seconds that hold the strong motion: quick to estimate from."""


@cache
def estimated(kind: str, motion: str, noise: float, seed: int) -> RestoringForce:
    return estimate(estimator_input(recorded(KINDS[kind], motion, noise, seed)))


def judged(kind: str, motion: str, noise: float, seed: int) -> Agreement:
    return agreement(
        exact_response(KINDS[kind], motion, seed % KINDS[kind].draws).force, estimated(kind, motion, noise, seed)
    )


def short(measured: Sequence[int], noise: float = 0.01, seed: int = 0) -> InstrumentedSuperstructure:
    """Part of Kobe on the paper's building, any floors measured."""
    exact = exact_response(IN_CLASS, "Kobe").acceleration[[0, *(floor + 1 for floor in measured)], SHORT]
    spread = noise * np.sqrt(np.mean(exact**2, axis=1, keepdims=True))
    channels = exact + spread * np.random.default_rng([7, seed]).standard_normal(exact.shape)
    return InstrumentedSuperstructure(
        RATE, channels[0], channels[1:], np.array(measured), BUILDING.base_mass, BUILDING.floor_mass
    )


@pytest.mark.accuracy
@pytest.mark.parametrize("noise", [0.01, 0.10])
def test_each_records_band_covers_the_force(noise: float) -> None:
    """The goal, 93 to 97 %, is for the mean over records; one record's correlated errors scatter about it by 2 %."""
    shares = [judged("in class", "Kobe", noise, seed).coverage for seed in (0, 1)]
    assert all(0.90 <= share <= 0.99 for share in shares)


@pytest.mark.accuracy
@pytest.mark.parametrize("noise", [0.01, 0.10])
@pytest.mark.parametrize("kind", ["in class", "constant modal damping 2 %"])
def test_the_force_errs_at_the_frequencies_and_in_the_patterns_that_are_stated(kind: str, noise: float) -> None:
    """In units of what is said, by bands of frequencies of more than 100 coefficients: 1 but for what is not known of
    how strongly the floors without a sensor move, for which the bounds leave 40 %; 0.66 to 1.3 were measured."""
    result = estimated(kind, "Kobe", noise, 0)
    assert result.error is not None
    plain = whitening(result.force, RATE, result.error.at, patterns=result.error.patterns)
    weights = shrunk(plain, result.force, result.error.at)
    true = weights.filtered(exact_response(KINDS[kind], "Kobe").force[None])
    error = weights.whitened(weights.coefficients(result.force[None]) - true)[0]
    for low, high in pairwise((0.3, 1.0, 2.0, 4.0)):
        there = (weights.frequency >= low) & (weights.frequency < high)
        assert np.sqrt(np.mean(error[there] ** 2)) == pytest.approx(1.0, abs=0.4), (low, high)


@pytest.mark.accuracy
def test_what_is_stated_of_a_record_in_class() -> None:
    assessment = estimated("in class", "Kobe", 0.01, 0).assessment
    assert assessment is not None
    reported = as_given(Design.of(BUILDING.floor_mass, None, np.array([2, 6])), 0.0)
    assert (assessment.assumption, assessment.fallback, assessment.is_at_rest) == (reported.name, None, True)
    assert assessment.chi_square == pytest.approx(1.0, abs=0.1)  # the record determines the noise's level to 3 %
    assert assessment.prior_share < 0.05


@pytest.mark.accuracy
def test_what_is_stated_of_a_late_sensor() -> None:
    assessment = estimated("roof a sample late", "Kobe", 0.01, 0).assessment
    assert assessment is not None
    made = corrected(Design.of(BUILDING.floor_mass, None, np.array([2, 6])), 0.0)
    assert assessment.assumption.startswith(made.name)  # each mode may have a damping of its own
    assert 0.05 < assessment.prior_share < 1


@pytest.mark.accuracy
def test_a_record_that_does_not_rest() -> None:
    whole, cut = (
        estimated("in class", "Kobe", 0.01, 0).assessment,
        estimated("cut to its strongest 15 s", "Kobe", 0.01, 0),
    )
    assert whole is not None
    assert cut.assessment is not None
    assert (whole.is_at_rest, cut.assessment.is_at_rest) == (True, False)
    agreed = judged("cut to its strongest 15 s", "Kobe", 0.01, 0)
    assert agreed.fit > 99.0  # 99.6, less what an edit of the model may cost
    assert 0.90 <= agreed.coverage <= 0.99  # 15 s hold few independent errors


@pytest.mark.accuracy
@pytest.mark.parametrize("measured", [[6], [2, 6], [0, 3], [0, 1, 2, 3, 4, 5, 6]])
def test_any_floors(measured: list[int]) -> None:
    s = short(measured)
    result = estimate(s)
    assert result.estimator == NAME
    assert result.rigid + result.modal == pytest.approx(result.force)
    assert result.force.shape == result.std.shape == s.base_acceleration.shape
    assert (result.std > 0).all()
    assert result.assessment is not None
    assert 0 <= result.assessment.prior_share <= 1
    truly = exact_response(IN_CLASS, "Kobe").force[SHORT]
    assert fitting_rate(truly, result.force) >= max(fitting_rate(truly, cms.estimate(s).force) - 0.05, 98.0)


def test_all_floors_leave_nothing_to_the_model() -> None:
    """F = -Σ m_i a_i over measured levels, but for the noise that smoothing takes out."""
    s = short(list(range(7)))
    inertia_of_all = -s.base_mass * s.base_acceleration - s.floor_mass @ s.floor_acceleration
    force = exact_response(IN_CLASS, "Kobe").force[SHORT]
    assert fitting_rate(force, estimate(s).force) >= fitting_rate(force, inertia_of_all)
    assert fitting_rate(inertia_of_all, estimate(s).force) > 99


def test_a_building_of_one_storey() -> None:
    """A light floor on a heavy slab: the floor's acceleration is measured, so that the force is known."""
    s = short([6])
    small = replace(s, measured=np.array([0]), base_mass=2e6, floor_mass=np.array([1e6]))
    result = estimate(small)
    exact = -2e6 * s.base_acceleration - 1e6 * s.floor_acceleration[0]
    assert fitting_rate(exact, result.force) > 98  # of a noise of 1 % in either channel


def test_ten_seconds_are_enough() -> None:
    s = short([2, 6])
    brief = replace(s, base_acceleration=s.base_acceleration[:1000], floor_acceleration=s.floor_acceleration[:, :1000])
    result = estimate(brief)
    assert np.isfinite(result.force).all()
    assert result.assessment is not None
    assert fitting_rate(exact_response(IN_CLASS, "Kobe").force[SHORT][:1000], result.force) > 97


@pytest.mark.accuracy
def test_floors_that_the_model_shows_worse_than_interpolation_are_left_to_interpolation() -> None:
    """Floors on the straight line from the base slab to a roof that moves in part as it likes, as of no inertia."""
    s = short([1, 3, 6], noise=1e-3)
    rng, base = np.random.default_rng(8), s.base_acceleration
    roof = s.floor_acceleration[2] - base + 0.3 * base.std() * rng.standard_normal(base.size)
    floors = base + np.array([[2], [4], [7]]) / 7 * roof
    floors += 1e-3 * floors.std() * rng.standard_normal(floors.shape)
    strange = replace(s, floor_acceleration=floors)
    result, static = estimate(strange), cms.estimate(strange)
    assert result.assessment is not None
    assert result.assessment.fallback is not None
    assert result.force == pytest.approx(static.force)
    assert result.std == pytest.approx(static.std)
    assert result.estimator == cms.NAME


def exchanged() -> InstrumentedSuperstructure:
    """The channels of three floors, in the wrong order."""
    s = short([1, 3, 6], noise=1e-3)
    return replace(s, floor_acceleration=s.floor_acceleration[[2, 1, 0]])


@pytest.mark.accuracy
def test_exchanged_floors_raise_nothing_and_are_stated_to_be_unexplained() -> None:
    result = estimate(exchanged())
    assert np.isfinite(result.force).all()
    assert np.isfinite(result.std).all()
    assert (result.std > 0).all()
    assert result.assessment is not None
    assert result.assessment.chi_square > 100


def test_refuses_what_it_cannot_use() -> None:
    s = short([2, 6])
    gap = s.floor_acceleration.copy()
    gap[1, 5] = np.nan
    with pytest.raises(RecordError, match="gaps"):
        estimate(replace(s, floor_acceleration=gap))
    with pytest.raises(ModelError, match="mass must be positive"):
        estimate(replace(s, floor_mass=np.array([*BUILDING.floor_mass[:-1], 0.0])))
    with pytest.raises(RecordError, match="too short"):
        estimate(
            replace(s, base_acceleration=s.base_acceleration[:900], floor_acceleration=s.floor_acceleration[:, :900])
        )


@pytest.mark.parametrize("silent", [(0,), (1,), (1, 2), (0, 1, 2)])
def test_channels_of_zeros_leave_the_force_to_the_paper_s_estimator_with_the_reason(silent: tuple[int, ...]) -> None:
    """Channel 0 is the base slab. Without any noise in a channel the calibration cannot weigh it."""
    s = short([3, 6])
    channels = np.vstack([s.base_acceleration, s.floor_acceleration])
    channels[list(silent)] = 0.0
    still = replace(s, base_acceleration=channels[0], floor_acceleration=channels[1:])
    result, paper = estimate(still), cms.estimate(still)
    assert result.assessment is not None
    assert "the calibration broke down" in str(result.assessment.fallback)
    assert result.estimator == cms.NAME
    assert np.array_equal(result.force, paper.force)


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
    exact = exact_response(IN_CLASS, "Kobe").acceleration[[0, 3, 7]]
    noise = 0.01 * np.sqrt(np.mean(exact**2, axis=1, keepdims=True))
    channels = exact + noise * np.random.default_rng(5).standard_normal(exact.shape)
    measured = np.array([2, 6])
    return InstrumentedSuperstructure(
        RATE, channels[0], channels[1:], measured, BUILDING.base_mass, BUILDING.floor_mass, stiffness
    )


@cache
def calibrated_from(scale: float) -> StoreyStiffness:
    storeys = estimate(superstructure(scale * told_stiffness())).storeys
    assert storeys is not None
    return storeys


@pytest.mark.accuracy
def test_the_softened_storey_has_the_largest_change() -> None:
    """Within four standard deviations."""
    expected = np.log(np.where(np.arange(7) == SOFTENED, 1 - LOST, 1.0))
    storeys = calibrated_from(1.0)
    assert int(np.argmin(storeys.deviation)) == SOFTENED
    assert (np.abs(storeys.deviation - expected) < 4 * np.sqrt(np.diag(storeys.covariance))).all()


@pytest.mark.accuracy
def test_deviations_are_from_the_design_as_reported() -> None:
    """The calibration knows the design up to a scale only."""
    assert calibrated_from(1.2).deviation == pytest.approx(calibrated_from(1.0).deviation - np.log(1.2), abs=1e-6)


@pytest.mark.accuracy
def test_nothing_is_stated_where_no_one_gave_a_stiffness() -> None:
    assert estimate(superstructure(None)).storeys is None
    assert estimate(replace(superstructure(told_stiffness()), storey_stiffness=None)).storeys is None
