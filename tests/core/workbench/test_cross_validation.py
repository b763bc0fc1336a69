"""Effects added because they predict earthquakes that were left out, against a law that is known."""

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.model.force_response import force_history
from core.model.isolator import Isolator
from core.workbench import cross_validation
from core.workbench.cross_validation import (
    Validated,
    beyond_range,
    can_validate,
    is_exhausted,
    is_sound_beyond,
    validated,
)
from core.workbench.earthquakes import Earthquakes
from core.workbench.fitting import fit
from core.workbench.progress import silent

HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 8e10, "k5": 0.0}})
OFFERED = ("hardening", "friction", "stiffness_step")


def seen(truth: Isolator = HARD) -> Earthquakes:
    return Earthquakes.of(observations(truth, 0.02, seed=3, peaks=(0.05, 0.08, 0.06), seconds=21.0))


@pytest.fixture(scope="module")
def steps() -> list[Validated]:
    """From a model with a useless friction."""
    earthquakes = seen()
    begun = fit(Isolator({**BOUC_WEN.effects, "friction": {}}), earthquakes).model
    return list(validated(begun, earthquakes, BOUC_WEN.effects, OFFERED, silent))


@pytest.mark.accuracy
def test_the_right_effect_is_added_and_the_stand_in_removed(steps: list[Validated]) -> None:
    """Beside hardening friction predicts nothing; a step in time is not tried, though it is offered."""
    assert [(one.change, one.is_added) for one in steps] == [("", True), ("hardening", True), ("friction", False)]
    assert set(steps[-1].model.effects) == set(HARD.effects)
    assert steps[0].error > 2 * steps[1].error
    assert steps[-1].error < 0.03
    assert list(steps[-1].errors) == ["event 0", "event 1", "event 2"]


def test_stronger_earthquakes_are_predicted_by_weaker_ones(steps: list[Validated]) -> None:
    """80 mm by 50 and 60 mm, and both stronger ones by 50 mm alone; only then is hardening worth adding."""
    before, after = steps[0], steps[1]
    assert [one.fitted_to for one in after.trials] == [("event 0", "event 2"), ("event 0",)]
    assert [set(one.errors) for one in after.trials] == [{"event 1"}, {"event 1", "event 2"}]
    assert [one.reach for one in after.trials] == [pytest.approx(80 / 60), pytest.approx(80 / 50)]
    assert after.trials[0].errors["event 1"] == after.errors["event 1"]
    assert before.error_in_stronger > 2 * after.error_in_stronger
    assert before.error_in_stronger > before.error


def test_the_error_beyond_the_range_is_at_least_that_of_the_truth(steps: list[Validated]) -> None:
    """At 1.5 and 2 times 80 mm: the model with hardening is nearly right there, that without it is not."""
    without, right = (beyond_range(step, seen()) for step in (steps[0], steps[-1]))
    assert [one.displacement for one in right] == [pytest.approx(0.12), pytest.approx(0.16)]
    for one in right:
        assert one.error >= one.spread
        assert truth_error(steps[-1], one.times) < one.error < 0.1
    assert [one.error for one in without] > [2 * one.error for one in right]


def truth_error(step: Validated, times: float) -> float:
    """Error of the force over the true one, in the strongest earthquake's motion enlarged."""
    one = seen().strongest
    motion = (times * one.layer.displacement, times * one.layer.velocity, one.rate)
    true, model = (force_history(each, *motion, one.conditions) for each in (HARD, step.model))
    return float(np.linalg.norm(model - true) / np.linalg.norm(true))


@pytest.mark.parametrize(
    ("effects", "is_sound"),
    [
        ({"hardening": {"k3": 8e10, "k5": 0.0}}, True),
        ({"hardening": {"k3": 0.0, "k5": 1e14}}, False),
        ({"loop_shape": {"k_2": -9e8, "k_3": 0.0}}, False),
    ],
)
def test_a_force_that_no_passive_layer_has_far_beyond_the_range_is_unsound(
    effects: dict[str, dict[str, float]], is_sound: bool
) -> None:
    """Growth with the cube is allowed, with the fifth power it is not, and neither is a negative stiffness."""
    assert is_sound_beyond(Isolator({**BOUC_WEN.effects, **effects}), seen()) is is_sound


def test_a_search_that_may_add_no_more_effects_is_told_from_one_that_found_none(
    steps: list[Validated], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not is_exhausted(steps)
    monkeypatch.setattr(cross_validation, "MOST_ADDED", sum(step.is_added for step in steps[1:]))
    assert is_exhausted(steps)


def test_a_term_that_no_record_makes_act_stays_zero(steps: list[Validated]) -> None:
    """The fifth power takes nothing from this law, and beyond the records it would be anything."""
    assert steps[-1].zero == {("hardening", "k5")}
    assert steps[-1].model.effects["hardening"]["k5"] == 0
    assert steps[-1].model.effects["hardening"]["k3"] == pytest.approx(8e10, rel=0.1)


def test_a_later_fit_leaves_such_a_term_at_zero_and_says_so(steps: list[Validated]) -> None:
    later = fit(steps[-1].model, seen())
    assert later.zero == {("hardening", "k5")}
    assert later.model.effects["hardening"] == {"k3": pytest.approx(8e10, rel=0.1), "k5": 0}
    assert "The term k5 of hardening (force over its fifth power) is 0 in the model and stays 0" in later.fit_text[-1]


def test_a_later_fit_frees_the_term_once_records_make_it_act() -> None:
    """In earthquakes whose layer has the fifth power, of a size that matters."""
    truth = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 8e10, "k5": 5e13}})
    given = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 8e10, "k5": 0.0}})
    later = fit(given, seen(truth))
    assert later.zero == frozenset()
    assert later.model.effects["hardening"]["k5"] == pytest.approx(5e13, rel=0.1)
    assert not any("stays 0" in sentence for sentence in later.fit_text)


def test_nothing_is_added_where_nothing_is_missing() -> None:
    """Though each takes a little where it is fitted."""
    offered = ("displacement_damping", "hardening", "power_viscous", "recent_softening")
    (only,) = validated(BOUC_WEN, seen(BOUC_WEN), BOUC_WEN.effects, offered, silent)
    assert (only.change, set(only.model.effects)) == ("", set(BOUC_WEN.effects))


def test_one_earthquake_cannot_be_left_out() -> None:
    earthquakes = seen()
    assert can_validate(Earthquakes.of(earthquakes, earthquakes.fitted_names[:1]))
    assert not can_validate(Earthquakes.of(earthquakes, earthquakes.fitted_names[:2]))
