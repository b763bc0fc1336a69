"""Two effects are searched together: what neither the first one nor steps from it find."""

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.joint_effects import best_pair
from core.diagnosis.missing_effects import Outcome, diagnosed
from core.diagnosis.ranking import DECISIVE, ranked
from core.fitting.data import FitData
from core.model.isolator import Isolator

OFFERED = ("friction", "breakaway", "maxwell", "moat", "hardening", "relief", "second_hysteresis")
HIDDEN = {"maxwell": {"K": 3e8, "tau": 0.05}, "moat": {"gap": 0.05, "gap_back": 0.05, "wall": 4e8, "wall_back": 4e8}}
TRUTH = Isolator({**BOUC_WEN.effects, **HIDDEN})


@pytest.mark.accuracy
def test_a_pair_is_found_from_the_effects_that_come_near_alone() -> None:
    """A stand-in of two effects, dry friction and hardening, explains less than the two that are there."""
    data = FitData.by_noise(observations(TRUTH, 0.01, 4))
    first = ranked(data, BOUC_WEN, OFFERED)
    stand_in = ranked(data, BOUC_WEN, ("friction",)).candidates[0].fit.model
    joint = best_pair(data, first, OFFERED, stand_in, 1.0)
    assert joint is not None
    assert joint.effects == ("maxwell", "moat")
    assert joint.delta_bic < -DECISIVE
    assert joint.fit.chi_square / joint.data.target.size < 1.1


@pytest.mark.accuracy
def test_there_is_no_pair_that_leaves_half_of_what_the_hidden_one_leaves() -> None:
    data = FitData.by_noise(observations(TRUTH, 0.01, 4))
    assert best_pair(data, ranked(data, BOUC_WEN, OFFERED), OFFERED, TRUTH, 0.5) is None


def test_there_is_no_pair_of_a_single_effect() -> None:
    data = FitData.by_noise(observations(TRUTH, 0.01, 4))
    assert best_pair(data, ranked(data, BOUC_WEN, ("moat",)), ("moat",), BOUC_WEN, 1.0) is None


@pytest.mark.accuracy
def test_a_pair_is_named_where_a_single_effect_takes_part_of_both() -> None:
    diagnosis = diagnosed(observations(TRUTH, 0.01, 4), BOUC_WEN, OFFERED)
    assert diagnosis.outcome is Outcome.EFFECT
    assert {step.chosen.effect for step in diagnosis.named} == set(HIDDEN)
    assert diagnosis.unexplained.noise_ratio < 1.1


@pytest.mark.accuracy
def test_the_values_of_a_pair_are_those_of_its_joint_fit() -> None:
    """A length at which friction changes abruptly among them, to a third."""
    truth = Isolator(
        {
            **BOUC_WEN.effects,
            "maxwell": HIDDEN["maxwell"],
            "friction": {"sliding": 1.2e6, "share": 0.5, "a": 30.0, "slip": 3e-4},
        }
    )
    data = FitData.by_noise(observations(truth, 0.01, 4))
    joint = best_pair(data, ranked(data, BOUC_WEN, ("friction", "maxwell")), ("friction", "maxwell"), BOUC_WEN, 1.0)
    assert joint is not None
    slip = joint.fit.model.effects["friction"]["slip"]
    assert np.abs(slip - 3e-4) < 1e-4
    assert joint.fit.chi_square / joint.data.target.size < 1.1
