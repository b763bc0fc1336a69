"""One storey that has lost stiffness is named; storeys that are all softer, or each a little, are not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.arrays import Matrix, Vector
from core.diagnosis.softened_storey import softened_storey
from core.estimators.result import StoreyStiffness

FLOORS = 7
STEPS = np.tril(np.ones((FLOORS, FLOORS)))


def reported(deviation: Vector, error: float, rng: np.random.Generator) -> StoreyStiffness:
    """A record that determines every storey with that error, and a prior of storeys as stiff as those below."""
    prior = (STEPS * np.array([10.0, *[0.3] * (FLOORS - 1)]) ** 2) @ STEPS.T
    information = np.eye(FLOORS) / error**2
    covariance: Matrix = np.asarray(np.linalg.inv(information + np.linalg.inv(prior)), dtype=float)
    seen = deviation + error * rng.standard_normal(FLOORS)
    return StoreyStiffness(np.asarray(covariance @ information @ seen), covariance, prior)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, FLOORS - 1), st.floats(0.25, 0.5), st.floats(-0.3, 0.3), st.integers(0, 10**6))
def test_a_softened_storey_is_named(storey: int, lost: float, common: float, seed: int) -> None:
    """Five standard deviations of its change."""
    rng = np.random.default_rng(seed)
    deviation = common + 0.01 * rng.standard_normal(FLOORS)
    deviation[storey] += np.log(1 - lost)
    result = softened_storey([reported(deviation, 0.02, rng) for _ in range(4)])
    assert result is not None
    assert (result.storey, result.others) == (storey, ())
    assert abs(result.change + lost) < 5 * result.std


@settings(max_examples=50, deadline=None)
@given(st.floats(-0.4, 0.4), st.floats(0.0, 0.03), st.sampled_from([0.005, 0.05, 0.2]), st.integers(0, 10**6))
def test_what_designs_leave_open_is_no_softened_storey(common: float, own: float, error: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    deviation = common + own * rng.standard_normal(FLOORS)
    assert softened_storey([reported(deviation, error, rng) for _ in range(4)]) is None


def test_a_stiffer_storey_is_not_softened() -> None:
    deviation = np.where(np.arange(FLOORS) == 3, 0.4, 0.0)
    assert softened_storey([reported(deviation, 0.02, np.random.default_rng(seed)) for seed in range(4)]) is None


@pytest.mark.parametrize("stiffer", [2, 0])
def test_storeys_beside_a_much_stiffer_one_are_not_softened(stiffer: int) -> None:
    """Wrong floor masses make one storey seem twice as stiff, and two others a quarter softer than the rest."""
    deviation = np.where(np.arange(FLOORS) == stiffer, 0.7, 0.0)
    deviation[[4, 6]] = -0.3
    assert softened_storey([reported(deviation, 0.02, np.random.default_rng(seed)) for seed in range(4)]) is None
    deviation[stiffer], deviation[6] = 0.0, 0.0
    found = softened_storey([reported(deviation, 0.02, np.random.default_rng(seed)) for seed in range(4)])
    assert found is not None
    assert found.storey == 4


def test_one_record_that_contradicts_the_others_counts_little() -> None:
    """It is sure of what is wrong by twenty of its standard deviations."""
    rng = np.random.default_rng(3)
    wrong = reported(np.array([0.0, 0.5, 0.5, -0.5, 0.0, 0.2, 0.0]), 0.01, rng)
    assert softened_storey([*(reported(np.zeros(FLOORS), 0.05, rng) for _ in range(3)), wrong]) is None


def test_storeys_that_records_do_not_show_apart_are_all_named() -> None:
    """Known is only the sum of two storeys' flexibilities."""
    rng = np.random.default_rng(4)
    deviation = np.where(np.arange(FLOORS) == 2, -0.8, 0.0)
    clear = reported(deviation, 0.02, rng)
    mixed = np.eye(FLOORS)
    mixed[2:4, 2:4] = 0.5
    information = mixed @ clear.information @ mixed
    covariance = np.linalg.inv(information + np.linalg.inv(clear.prior_covariance))
    vague = StoreyStiffness(np.asarray(covariance @ information @ deviation), covariance, clear.prior_covariance)
    storey = softened_storey([vague] * 3)
    assert storey is not None
    assert {storey.storey, *storey.others} == {2, 3}


SOFT = np.where(np.arange(FLOORS) == 4, np.log(0.7), 0.0)


def beside_masses(evidence: float, rng: np.random.Generator) -> StoreyStiffness:
    """A record in which corrected masses hide the softened storey, with log evidence of the masses as given."""
    hidden = reported(np.zeros(FLOORS), 0.1, rng)
    return replace(hidden, with_given_masses=reported(SOFT, 0.02, rng), evidence_of_masses=evidence)


def test_a_storey_that_corrected_masses_hide_is_named_where_all_records_speak_for_the_given_ones() -> None:
    rng = np.random.default_rng(5)
    evidence = [-9.0, 12.0, 8.0, -4.0]
    found = softened_storey([beside_masses(one, rng) for one in evidence])
    assert found is not None
    assert (found.storey, found.or_masses) == (4, True)
    assert softened_storey([beside_masses(-one, rng) for one in evidence]) is None


def test_one_record_does_not_decide_about_the_masses() -> None:
    """Its calibration may have failed."""
    rng = np.random.default_rng(6)
    found = softened_storey([beside_masses(one, rng) for one in (-1e4, 15.0, 12.0, 8.0)])
    assert found is not None
    assert found.storey == 4


def test_where_masses_are_wrong_a_storey_needs_more_evidence() -> None:
    rng = np.random.default_rng(7)
    weak = [reported(np.where(np.arange(FLOORS) == 2, np.log(0.75), 0.0), 0.05, rng) for _ in range(4)]
    assert softened_storey(weak) is not None
    assert softened_storey([replace(one, evidence_of_masses=-40.0) for one in weak]) is None
    clear = [reported(SOFT, 0.02, rng) for _ in range(4)]
    assert softened_storey([replace(one, evidence_of_masses=-40.0) for one in clear]) is not None


def test_a_building_of_one_storey_has_no_others_to_compare_with() -> None:
    one = StoreyStiffness(np.array([-0.4]), np.array([[1e-4]]), np.array([[100.0]]))
    assert softened_storey([one] * 3) is None
    assert pytest.approx(one.information[0, 0]) == 1e4 - 0.01
